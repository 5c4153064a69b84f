/// Serves poses to programs: the sockets around SubscriptionDesk.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "estimator/core/config.hpp"
#include "estimator/core/outputs.hpp"
#include "net/pose_push.hpp"
#include "net/subscription_desk.hpp"
#include "net/udp_socket.hpp"

namespace crepes {

class SubscriptionServer {
 public:
  /// Addresses that cannot be served are left out and told by `faults`.
  SubscriptionServer(const Config& config, SubscriptionDesk::StatusSource status);

  /// Names, limits and push targets from now on; subscribers stay. `listen` and `port` must be the
  /// same.
  void reconfigure(const Config& config);

  /// Answers the requests that wait on all sockets, a bounded number of them.
  void serve(Timestamp now);
  /// Sends the poses of one instant to those who want them now.
  void publish(const std::vector<NeighborPose>& poses, Timestamp now);

  /// For poll(2).
  [[nodiscard]] std::vector<int> descriptors() const;
  [[nodiscard]] const std::vector<std::string>& faults() const { return faults_; }
  /// Totals by name.
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() const;

 private:
  void open_push(const Config& config);
  void send(UdpSocket& socket, const std::string& json, const Endpoint& to);

  RobotId self_;
  std::map<RobotId, std::string> names_;
  SubscriptionDesk desk_;
  std::vector<UdpSocket> sockets_;
  std::vector<PosePush> pushes_;
  std::optional<UdpSocket> push_ipv4_;
  std::optional<UdpSocket> push_ipv6_;
  std::vector<std::string> faults_;
  std::uint64_t poses_ = 0;
  std::uint64_t pushed_ = 0;
  std::uint64_t unsent_ = 0;
};

}  // namespace crepes
