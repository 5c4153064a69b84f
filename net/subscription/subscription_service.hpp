/// The pose subscription without its sockets: requests in, replies out. Pure: time is passed in.
///
/// The source address of a remote client may be forged. Until the client echoes a cookie, replies
/// are never longer than its request. A request shorter than the COOKIE receives no reply: clients
/// pad their requests.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "net/subscription/address_cookies.hpp"
#include "net/subscription/request_limiter.hpp"
#include "net/subscription/subscriber_table.hpp"

namespace crepes {

class SubscriptionService {
 public:
  using StatusSource = std::function<SystemStatus()>;

  /// `key` is random and generated at each start.
  SubscriptionService(const SubscriptionConfig& config, std::string release, StatusSource status,
                      const HashKey& key);

  /// Applies new leases and limits; existing subscriptions remain.
  void reconfigure(const SubscriptionConfig& config);

  /// The reply to a datagram that was received over `socket`, if any.
  [[nodiscard]] std::optional<std::string> answer(const Endpoint& client, std::string_view request,
                                                  Timestamp now, std::size_t socket = 0);

  /// As SubscriberTable's.
  [[nodiscard]] std::vector<PoseDelivery> deliveries(RobotId neighbor, Timestamp stamp,
                                                     Timestamp now);

  /// Totals by name.
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() const;

 private:
  [[nodiscard]] bool allows(const Endpoint& client, std::string_view request, Timestamp now);
  [[nodiscard]] std::optional<std::string> serve(const Endpoint& client,
                                                 const SubscriptionRequest& request, Timestamp now,
                                                 std::size_t socket);
  [[nodiscard]] std::optional<std::string> status_of(const PollRequest& poll) const;
  [[nodiscard]] std::optional<std::string> refuse(const Endpoint& client, const Error& error,
                                                  Timestamp now);

  int port_;
  double lease_s_;
  std::string release_;
  StatusSource status_;
  SubscriberTable table_;
  AddressCookies cookies_;
  RequestLimiter limiter_;
  std::uint64_t requests_ = 0;
  std::uint64_t refused_ = 0;
  std::uint64_t excess_ = 0;
  std::uint64_t unanswerable_ = 0;
  std::uint64_t unverified_ = 0;
};

}  // namespace crepes
