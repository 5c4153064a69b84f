/// A swarm in the air on virtual time, what strikes it, and what is checked at every step.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/ctl/replay/virtual_swarm.hpp"
#include "tests/faults/clients.hpp"
#include "tests/faults/fault.hpp"
#include "tests/faults/network_faults.hpp"
#include "tests/faults/pose_trace.hpp"
#include "tests/faults/robot_faults.hpp"
#include "tests/study/pair_sightings.hpp"

namespace crepes::faults {

using Pair = std::pair<RobotId, RobotId>;  ///< observer and neighbor
using Traces = std::map<Pair, PoseTrace>;

class Flight {
 public:
  /// `swarm` must outlive it. `sealed`: datagrams are sealed and signed.
  Flight(const study::Swarm& swarm, bool sealed);
  Flight(const Flight&) = delete;
  Flight(Flight&&) = delete;
  Flight& operator=(const Flight&) = delete;
  Flight& operator=(Flight&&) = delete;
  ~Flight() = default;

  /// Flies on until `true_s`. Every 0.1 s it is checked what must hold of the programs.
  void fly_until(double true_s);
  /// From now on; none may have begun.
  void strike(const std::vector<Fault>& faults);

  [[nodiscard]] const Traces& traces() const { return traces_; }
  /// Of a robot's mesh.
  [[nodiscard]] const MeshCounters& counters(RobotId robot) {
    return swarm_.robot(robot).link.counters();
  }
  /// What did not hold, a line each.
  [[nodiscard]] std::vector<std::string> complaints() const;
  /// The most that the heap has grown since the faults began [bytes].
  [[nodiscard]] std::uint64_t heap_growth() const { return heap_growth_; }

 private:
  void add_pose(RobotId observer, const NeighborPose& pose);
  void check();
  void check_datagrams(const VirtualRobot& robot);
  void check_readings(const VirtualRobot& robot);
  void complain(std::string what);

  /// What had been handed to a robot's estimator at a step.
  struct Readings {
    std::uint64_t ranges = 0;
    std::uint64_t bearings = 0;
    std::uint64_t samples = 0;
  };

  const study::Swarm& study_;
  std::optional<SwarmTruth> no_truth_;
  ReplaySinks sinks_;
  VirtualSwarm swarm_;
  Clients clients_;
  FaultyNetwork network_;
  std::deque<Action> actions_;
  double now_s_ = 0.0;
  double next_check_s_ = 0.0;
  Traces traces_;
  std::map<RobotId, std::deque<Readings>> handed_;  ///< at the last steps
  bool counts_readings_ = true;
  std::uint64_t heap_before_ = 0;
  std::uint64_t heap_growth_ = 0;
  std::vector<std::string> complaints_;
};

}  // namespace crepes::faults
