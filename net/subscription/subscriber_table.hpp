/// Subscribers with their leases and rates. Pure: time is passed in.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "estimator/core/result.hpp"
#include "net/endpoint.hpp"
#include "net/subscription/rate_divider.hpp"
#include "net/subscription/request_limiter.hpp"
#include "net/subscription/subscription_config.hpp"
#include "net/subscription/subscription_json.hpp"

namespace crepes {

/// One pose for one client.
struct PoseDelivery {
  Endpoint client;
  std::uint64_t sequence = 0;  ///< counts this client's poses, from 0
  std::size_t socket = 0;      ///< index of the socket that received its request
};

class SubscriberTable {
 public:
  explicit SubscriberTable(SubscriptionConfig config) : config_(std::move(config)) {}

  /// Applies new leases and limits; existing subscriptions remain.
  void reconfigure(const SubscriptionConfig& config) { config_ = config; }

  /// Begins, renews, changes or ends a subscription. Refused when the table is full or the address
  /// has used all its subscriptions; this machine's addresses are one. Remote clients never take
  /// the room of this machine's: `max_per_address`, at most half of all. At a full address a new
  /// client that `is_light_user` replaces one that recently exceeded its rate. Replies are sent
  /// over `socket`.
  [[nodiscard]] Result<void> watch(const Endpoint& client, const WatchRequest& request,
                                   Timestamp now, std::size_t socket = 0,
                                   bool is_light_user = false);

  /// Whether a subscriber may send a request now; empty for other clients.
  [[nodiscard]] std::optional<bool> allows(const Endpoint& client, Timestamp now);

  /// The clients for which a pose of `neighbor` at `stamp` is due; it counts as delivered. Stamps
  /// of one neighbor must not decrease. Call `expire` first.
  [[nodiscard]] std::vector<PoseDelivery> deliveries(RobotId neighbor, Timestamp stamp);

  /// Removes subscribers whose lease has expired.
  void expire(Timestamp now);

  /// Whether an ERROR may be sent to a client now: at most one a second, and to a limited number of
  /// clients at a time; remote clients do not take the room of local ones. If so, it counts as
  /// sent.
  [[nodiscard]] bool allows_error(const Endpoint& client, Timestamp now);

  [[nodiscard]] std::size_t size() const { return subscribers_.size(); }

 private:
  struct Subscriber {
    WatchRequest request;
    Timestamp lease_end{};
    std::size_t socket = 0;
    std::uint64_t sequence = 0;
    RateDivider rate;
    TokenBucket requests{kClientRate};
    Timestamp last_excess = Timestamp::min();  ///< when a request found no token
  };

  [[nodiscard]] Result<void> find_place(const Endpoint& client) const;
  [[nodiscard]] Result<void> make_room(const Endpoint& client, Timestamp now, bool is_light_user);

  SubscriptionConfig config_;
  std::map<Endpoint, Subscriber> subscribers_;
  std::map<Endpoint, Timestamp> last_local_errors_;
  std::map<Endpoint, Timestamp> last_remote_errors_;
};

}  // namespace crepes
