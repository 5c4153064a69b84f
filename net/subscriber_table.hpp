/// Who wants poses, how often, and until when. Pure: time is passed in.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "estimator/core/config.hpp"
#include "estimator/core/result.hpp"
#include "net/endpoint.hpp"
#include "net/subscription_json.hpp"

namespace crepes {

/// One pose for one client.
struct PoseDelivery {
  Endpoint client;
  std::uint64_t sequence = 0;  ///< counts this client's poses, from 0
};

class SubscriberTable {
 public:
  explicit SubscriberTable(SubscriptionConfig config) : config_(std::move(config)) {}

  /// Only loopback sources are answered at all.
  [[nodiscard]] static bool is_served(const Endpoint& client) { return client.is_loopback(); }

  /// Begins, renews, changes or ends a subscription; refused when the table is full.
  [[nodiscard]] Result<void> watch(const Endpoint& client, const WatchRequest& request,
                                   Timestamp now);

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
    std::uint64_t sequence = 0;
    std::map<RobotId, Timestamp> next_due;
  };

  SubscriptionConfig config_;
  std::map<Endpoint, Subscriber> subscribers_;
  std::map<Endpoint, Timestamp> last_errors_;
};

}  // namespace crepes
