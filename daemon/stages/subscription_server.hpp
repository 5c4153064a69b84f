/// Serves poses to clients: the sockets around SubscriptionService.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "estimator/core/outputs.hpp"
#include "net/subscription/pose_push.hpp"
#include "net/subscription/subscription_config.hpp"
#include "net/subscription/subscription_service.hpp"
#include "net/udp_socket.hpp"

namespace crepes {

class SubscriptionServer {
 public:
  /// What cannot be opened is the `fault`.
  SubscriptionServer(RobotId self, const std::map<RobotId, std::string>& names,
                     const SubscriptionConfig& config, SubscriptionService::StatusSource status);

  /// Changes names, limits and push targets; subscribers stay. `listen` and `port` must be the
  /// same.
  void reconfigure(const std::map<RobotId, std::string>& names, const SubscriptionConfig& config);

  /// Opens what could not be opened yet; call it about once a second. Updates `fault`; changes are
  /// logged.
  void open_missing();

  /// Answers a bounded number of the requests that wait on all sockets.
  void serve(Timestamp now);
  /// Sends the poses of one instant to the subscribers whose next pose is due.
  void publish(const std::vector<NeighborPose>& poses, Timestamp now);

  /// For poll(2).
  [[nodiscard]] std::vector<int> descriptors() const;
  /// The addresses that cannot be served, and why poses cannot be pushed, as of the last
  /// `open_missing`; empty without either.
  [[nodiscard]] const std::string& fault() const { return fault_; }
  /// Totals by name.
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() const;

 private:
  // Both return what failed.
  [[nodiscard]] std::string open_listen();
  [[nodiscard]] std::string open_push();
  /// How a request came. Subscribers refer to it by its index.
  struct Way {
    std::size_t socket = 0;
    std::optional<Endpoint> own{};  ///< which of this machine's addresses, if the socket serves all

    [[nodiscard]] bool operator==(const Way&) const = default;
  };
  [[nodiscard]] std::size_t index_of(const Way& way);
  /// Returns whether it was sent.
  bool send(std::size_t way, const std::string& json, const Endpoint& to);
  void note_push(const Endpoint& target, const Result<void>& sent);

  RobotId self_;
  std::map<RobotId, std::string> names_;
  SubscriptionService service_;
  std::uint16_t port_;
  std::vector<std::string> unserved_;  ///< addresses of `listen` without a socket
  std::vector<UdpSocket> sockets_;
  std::vector<Way> ways_;
  std::vector<PushConfig> push_configs_;
  std::vector<PosePush> pushes_;
  std::optional<UdpSocket> push_ipv4_;
  std::optional<UdpSocket> push_ipv6_;
  std::map<Endpoint, std::string> push_faults_;  ///< of the last datagram to a target
  std::string fault_;
  std::uint64_t poses_ = 0;
  std::uint64_t pushed_ = 0;
  std::uint64_t unsent_ = 0;
};

}  // namespace crepes
