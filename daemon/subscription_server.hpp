/// Serves poses to programs on this robot: the sockets around SubscriberTable and its JSON.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "estimator/core/config.hpp"
#include "estimator/core/outputs.hpp"
#include "net/subscriber_table.hpp"
#include "net/udp_socket.hpp"

namespace crepes {

class SubscriptionServer {
 public:
  using StatusSource = std::function<SystemStatus()>;

  /// Addresses that cannot be served are left out and told by `faults`.
  SubscriptionServer(const Config& config, StatusSource status);

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
  void answer(UdpSocket& socket, const Datagram& request, Timestamp now);
  void send(UdpSocket& socket, const std::string& json, const Endpoint& to);
  [[nodiscard]] UdpSocket* socket_for(const Endpoint& client);

  RobotId self_;
  double lease_s_;
  std::map<RobotId, std::string> names_;
  StatusSource status_;
  SubscriberTable table_;
  std::vector<UdpSocket> sockets_;
  std::vector<std::string> faults_;
  std::uint64_t requests_ = 0;
  std::uint64_t refused_ = 0;
  std::uint64_t poses_ = 0;
  std::uint64_t unsent_ = 0;
};

}  // namespace crepes
