/// Programs that subscribe to poses: one that is honest at every robot, and faulty ones.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/ctl/replay/virtual_swarm.hpp"
#include "net/subscription/subscription_service.hpp"
#include "tests/faults/dice.hpp"
#include "tests/faults/fault.hpp"

namespace crepes::faults {

/// The subscription service of every robot, without sockets.
class Clients {
 public:
  explicit Clients(VirtualSwarm& swarm);

  void strike(const std::vector<Fault>& faults);
  /// A pose is published.
  void add(RobotId robot, const NeighborPose& pose, double true_s);
  /// What clients do in a while; call it ten times a second.
  void step(double true_s);
  /// What an honest client or a limit of the service suffered, a line each.
  [[nodiscard]] const std::vector<std::string>& complaints() const { return complaints_; }

 private:
  struct Served {
    std::optional<SubscriptionService> service;
    double renewal_s = 0.0;
    bool is_subscribed = false;               ///< the honest client
    std::map<RobotId, std::uint64_t> unsent;  ///< poses on end that it did not get
  };

  void begin(RobotId robot);
  void serve_honest(RobotId robot, Served& at, double true_s);
  void misbehave(const Fault& fault, Served& at, Timestamp now);
  void complain(std::string what);

  VirtualSwarm& swarm_;
  std::map<RobotId, Served> robots_;
  std::vector<Fault> faults_;
  Dice dice_{1};
  std::vector<std::string> complaints_;
};

}  // namespace crepes::faults
