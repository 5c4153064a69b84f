/// The pose subscription without its sockets: who gets which answer. Pure: time is passed in.
///
/// A source that is not of this machine may be forged, so until it has echoed a cookie it gets no
/// answer longer than what it sent. A request shorter than the COOKIE gets none at all: clients pad
/// theirs.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "net/cookie_mint.hpp"
#include "net/request_limiter.hpp"
#include "net/subscriber_table.hpp"

namespace crepes {

class SubscriptionDesk {
 public:
  using StatusSource = std::function<SystemStatus()>;

  /// `key` is random, and new at each start.
  SubscriptionDesk(const SubscriptionConfig& config, std::string release, StatusSource status,
                   const HashKey& key);

  /// Leases and limits from now on; who is subscribed stays.
  void set_limits(const SubscriptionConfig& config);

  /// What to answer to a datagram that came over socket `via`, if anything.
  [[nodiscard]] std::optional<std::string> answer(const Endpoint& client, std::string_view request,
                                                  Timestamp now, std::size_t via = 0);

  /// As SubscriberTable's.
  [[nodiscard]] std::vector<PoseDelivery> deliveries(RobotId neighbor, Timestamp stamp,
                                                     Timestamp now);

  /// Totals by name.
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() const;

 private:
  [[nodiscard]] bool admits(const Endpoint& client, std::string_view request, Timestamp now);
  [[nodiscard]] std::optional<std::string> serve(const Endpoint& client,
                                                 const SubscriptionRequest& request, Timestamp now,
                                                 std::size_t via);
  [[nodiscard]] std::optional<std::string> refuse(const Endpoint& client, const Error& error,
                                                  Timestamp now);

  int port_;
  double lease_s_;
  std::string release_;
  StatusSource status_;
  SubscriberTable table_;
  CookieMint cookies_;
  RequestLimiter limiter_;
  std::uint64_t requests_ = 0;
  std::uint64_t refused_ = 0;
  std::uint64_t excess_ = 0;
  std::uint64_t unanswerable_ = 0;
  std::uint64_t unverified_ = 0;
};

}  // namespace crepes
