/// Serves poses to programs: the sockets around SubscriptionDesk.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "estimator/core/config.hpp"
#include "estimator/core/outputs.hpp"
#include "net/subscription_desk.hpp"
#include "net/udp_socket.hpp"

namespace crepes {

class SubscriptionServer {
 public:
  /// Addresses that cannot be served are left out and told by `faults`.
  SubscriptionServer(const Config& config, SubscriptionDesk::StatusSource status);

  /// Answers the requests that wait on all sockets, a bounded number of them.
  void serve(Timestamp now);
  /// Sends a pose to those who want it now.
  void publish(const NeighborPose& pose, Timestamp now);

  /// For poll(2).
  [[nodiscard]] std::vector<int> descriptors() const;
  [[nodiscard]] const std::vector<std::string>& faults() const { return faults_; }
  /// Totals by name.
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() const;

 private:
  void send(std::size_t via, const std::string& json, const Endpoint& to);

  RobotId self_;
  std::map<RobotId, std::string> names_;
  SubscriptionDesk desk_;
  std::vector<UdpSocket> sockets_;
  std::vector<std::string> faults_;
  std::uint64_t poses_ = 0;
  std::uint64_t unsent_ = 0;
};

}  // namespace crepes
