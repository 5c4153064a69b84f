/// Faults of the network and of what a robot reports.
#pragma once

#include <map>
#include <vector>

#include "daemon/ctl/replay/swarm_replay.hpp"
#include "tests/faults/dice.hpp"
#include "tests/faults/fault.hpp"

namespace crepes::faults {

/// Changes the deliveries of every datagram by the faults that last when it is sent.
class FaultyNetwork {
 public:
  FaultyNetwork(std::vector<Fault> faults, std::uint64_t seed)
      : faults_(std::move(faults)), dice_(seed) {}

  void operator()(RobotId from, RobotId to, double sent_s, std::vector<Delivery>& deliveries);

 private:
  void apply(const Fault& fault, RobotId from, RobotId to, double sent_s,
             std::vector<Delivery>& deliveries);
  void damage(std::vector<std::uint8_t>& bytes);

  std::vector<Fault> faults_;
  Dice dice_;
  std::map<RobotId, std::vector<Delivery>> recorded_;  ///< by sender: the first seconds
};

/// What lying robots change in the reports that they send at `true_s`.
void corrupt_report(const std::vector<Fault>& faults, double true_s, Report& report);

/// Robots that are switched off or frozen.
[[nodiscard]] std::vector<Outage> outages_of(const std::vector<Fault>& faults);

}  // namespace crepes::faults
