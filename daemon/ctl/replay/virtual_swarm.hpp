/// All robots of a recording on virtual time: one queue in the order of true time.
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "daemon/ctl/dataset/truth.hpp"
#include "daemon/ctl/replay/replay_output.hpp"
#include "daemon/ctl/replay/simulated_network.hpp"
#include "daemon/ctl/replay/swarm_replay.hpp"
#include "daemon/ctl/replay/virtual_robot.hpp"

namespace crepes {

/// No threads: the same input and seed give the same poses to the last bit. The robots see only
/// their own clocks.
class VirtualSwarm {
 public:
  /// `truth` and `sinks` must outlive it. `truth` counts wrong IDs; no estimator receives it.
  VirtualSwarm(SwarmDataset dataset, const std::optional<SwarmTruth>& truth,
               const ReplayOptions& options, const ReplaySinks& sinks);

  /// Readings of another recording of the same robots, which began at `from_s`.
  void append(SwarmDataset later, double from_s);
  /// Everything until `true_s`. A picture that cannot be read is an error.
  [[nodiscard]] Result<void> run_until(double true_s);
  /// The whole recording. `on_progress` is called with 0..1 regularly; it may be empty.
  [[nodiscard]] Result<void> run(const std::function<void(double)>& on_progress);

  /// The true time of what is handled.
  [[nodiscard]] double now_s() const { return now_s_; }
  [[nodiscard]] std::deque<VirtualRobot>& robots() { return robots_; }
  [[nodiscard]] VirtualRobot& robot(RobotId id);
  /// Between these a robot neither measures, sends nor receives.
  void switch_off(RobotId id) { robot(id).state = VirtualRobot::State::kOff; }
  void switch_on(RobotId id);
  void freeze(RobotId id) { robot(id).state = VirtualRobot::State::kFrozen; }
  /// It gets what has waited, at `true_s`.
  [[nodiscard]] Result<void> thaw(RobotId id, double true_s);
  /// A datagram of anybody, on its way.
  void send(double arrives_s, RobotId to, VirtualDatagram datagram);

  /// The robots' clocks once a second, since the last call; `report` has those that are left.
  [[nodiscard]] std::vector<ClockSample> take_clocks() { return std::exchange(clocks_, {}); }
  [[nodiscard]] ReplayReport report(const ReplayOptions& options) const;

 private:
  /// An input that reaches a robot at an instant of true time.
  struct Arrival {
    double true_s = 0.0;
    std::uint64_t order = 0;  ///< breaks ties in the order of scheduling
    std::size_t robot = 0;
    VirtualInput what;
  };
  struct Later {
    bool operator()(const Arrival& a, const Arrival& b) const {
      return std::pair(a.true_s, a.order) > std::pair(b.true_s, b.order);
    }
  };

  void schedule(double true_s, std::size_t robot, VirtualInput what);
  void schedule_at(Timestamp local, std::size_t robot, VirtualInput what, double delay_s = 0.0);
  void schedule_recording(std::size_t index);
  [[nodiscard]] Result<void> deliver_next();
  [[nodiscard]] Result<void> deliver(Arrival& arrival);
  [[nodiscard]] bool prepare(VirtualRobot& robot, double true_s, Event& event) const;
  void receive(const Arrival& arrival, const VirtualDatagram& datagram);
  [[nodiscard]] Result<void> detect(const Arrival& arrival, const PendingImage& due);
  void step(const Arrival& arrival, const Event& event);
  void handle_outputs(const Arrival& arrival, const Outputs& outputs);
  void broadcast(const Arrival& arrival, const Report& report);
  void broadcast(const Arrival& arrival, const std::vector<std::uint8_t>& datagram);
  [[nodiscard]] bool are_in_reach(RobotId a, RobotId b, double true_s) const;
  void count_id_mistakes(VirtualRobot& robot, const std::vector<Bearing>& bearings);
  void sample_clocks(VirtualRobot& robot, double true_s);

  SwarmManifest manifest_;
  const std::optional<SwarmTruth>& truth_;
  const ReplaySinks& sinks_;
  DatasetFaults faults_;
  SimulatedNetwork network_;
  double reach_m_;
  bool forwards_;
  SensorDelays delays_;
  std::deque<VirtualRobot> robots_;
  std::vector<Arrival> queue_;  ///< a heap, the next one first
  std::uint64_t next_order_ = 0;
  double now_s_ = 0.0;
  std::vector<ClockSample> clocks_;
};

}  // namespace crepes
