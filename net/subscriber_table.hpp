/// Who wants poses, how often, and until when. Pure: time is passed in.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "estimator/core/config.hpp"
#include "estimator/core/result.hpp"
#include "net/endpoint.hpp"
#include "net/pose_rate.hpp"
#include "net/request_limiter.hpp"
#include "net/subscription_json.hpp"

namespace crepes {

/// One pose for one client.
struct PoseDelivery {
  Endpoint client;
  std::uint64_t sequence = 0;  ///< counts this client's poses, from 0
  std::size_t via = 0;         ///< the socket over which it asked
};

class SubscriberTable {
 public:
  explicit SubscriberTable(SubscriptionConfig config) : config_(std::move(config)) {}

  /// Leases and limits from now on; who is subscribed stays.
  void set_limits(const SubscriptionConfig& config) { config_ = config; }

  /// Begins, renews, changes or ends a subscription; refused when the table is full or the address
  /// has its share. Of that share, who lately asked for more than he may gives way to a newcomer
  /// who `asks_little`. `via` says over which socket to answer.
  [[nodiscard]] Result<void> watch(const Endpoint& client, const WatchRequest& request,
                                   Timestamp now, std::size_t via = 0, bool asks_little = false);

  /// Whether a subscriber may ask now; empty for others.
  [[nodiscard]] std::optional<bool> admits(const Endpoint& client, Timestamp now);

  /// The clients for which a pose of `neighbor` at `stamp` is due, counted as delivered; stamps of
  /// one neighbor must not go back. Call `expire` first.
  [[nodiscard]] std::vector<PoseDelivery> deliveries(RobotId neighbor, Timestamp stamp);

  /// Ends the leases that ran out.
  void expire(Timestamp now);

  /// Whether a client may be sent an ERROR now: at most one a second, and none to further clients
  /// when very many err at once. Counts as sent.
  [[nodiscard]] bool admits_error(const Endpoint& client, Timestamp now);

  [[nodiscard]] std::size_t size() const { return subscribers_.size(); }

 private:
  struct Subscriber {
    WatchRequest wish;
    Timestamp lease_end{};
    std::size_t via = 0;
    std::uint64_t sequence = 0;
    PoseRate rate;
    TokenBucket requests{kClientRate};
    Timestamp last_excess = Timestamp::min();  ///< when a request found no token
  };

  [[nodiscard]] Result<void> make_room(const Endpoint& client, Timestamp now, bool asks_little);

  SubscriptionConfig config_;
  std::map<Endpoint, Subscriber> subscribers_;
  std::map<Endpoint, Timestamp> last_errors_;
};

}  // namespace crepes
