#include "tests/faults/flight.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <numeric>

#include "estimator/core/contract.hpp"
#include "tests/faults/sensor_faults.hpp"
#include "tests/support/heap.hpp"

namespace crepes::faults {
namespace {

constexpr double kCheckPeriod_s = 0.1;
constexpr std::size_t kPatience = 15;             // steps until a reading must have a verdict
constexpr std::uint64_t kMostGrowth = 64 << 20U;  // bytes of heap, of the whole swarm
constexpr double kOldest_s = 0.05;                // a pose when it is published
constexpr std::size_t kMostComplaints = 4;        // they come again at every step

ReplayOptions options_of(bool sealed) {
  ReplayOptions options;
  options.sealed = sealed;
  return options;
}

/// Datagrams that were received and gave no report.
std::uint64_t without_report(const MeshCounters& counters) {
  std::uint64_t sum =
      counters[MeshCounter::kHeldClockUnknown] + counters[MeshCounter::kReceivedAgain];
  for (std::size_t i = 0; i < kMeshCounterCount; ++i) {
    const auto counter = static_cast<MeshCounter>(i);
    const bool is_datagram =
        name_of(counter).starts_with("refused_") && counter != MeshCounter::kRefusedEcho &&
        counter != MeshCounter::kRefusedOwnId && counter != MeshCounter::kRefusedToSend;
    if (is_datagram) sum += counters[counter];
  }
  return sum;
}

std::uint64_t verdicts(const EstimatorStatus& status, MeasurementKind kind) {
  std::uint64_t sum = 0;
  for (const NeighborStatus& neighbor : status.neighbors) {
    const VerdictCounts& counts = neighbor.measurements.at(static_cast<std::size_t>(kind));
    sum = std::accumulate(counts.begin(), counts.end(), sum);
  }
  return sum;
}

}  // namespace

Flight::Flight(const study::Swarm& swarm, bool sealed)
    : study_(swarm),
      swarm_(swarm.dataset, no_truth_, options_of(sealed), sinks_),
      clients_(swarm_),
      network_(sealed) {
  for (const VirtualRobot& from : swarm_.robots())
    for (const VirtualRobot& to : swarm_.robots())
      if (from.id() != to.id()) traces_[{from.id(), to.id()}];
  sinks_.on_pose = [this](RobotId observer, const NeighborPose& pose) { add_pose(observer, pose); };
  // The adversary listens from the beginning.
  sinks_.on_delivery = [this](RobotId from, RobotId to, double sent_s,
                              std::vector<Delivery>& deliveries) {
    network_(from, to, sent_s, deliveries);
  };
}

void Flight::strike(const std::vector<Fault>& faults) {
  const std::vector<Action> actions = actions_of(faults);
  actions_.assign(actions.begin(), actions.end());
  clients_.strike(faults);
  network_.strike(faults);
  sinks_.on_reading = SensorFaults(faults);
  sinks_.on_report = [this, liars = Liars(faults)](Report& report) mutable {
    liars(swarm_.now_s(), report);
  };
  // With a neighbor go its counters.
  counts_readings_ = std::ranges::none_of(
      faults, [](const Fault& fault) { return fault.kind == Kind::kMemberRemoved; });
  heap_before_ = static_cast<std::uint64_t>(test::heap_bytes());
}

void Flight::fly_until(double true_s) {
  const auto next_action_s = [&] { return actions_.empty() ? true_s : actions_.front().at_s; };
  while (now_s_ < true_s) {
    now_s_ = std::max(now_s_, std::min({true_s, next_action_s(), next_check_s_}));
    CREPES_EXPECT(swarm_.run_until(now_s_).has_value(), "there are no pictures to read");
    while (!actions_.empty() && actions_.front().at_s <= now_s_) {
      actions_.front().apply(swarm_);
      actions_.pop_front();
    }
    if (next_check_s_ > now_s_) continue;
    clients_.step(now_s_);
    check();
    next_check_s_ += kCheckPeriod_s;
  }
}

void Flight::add_pose(RobotId observer, const NeighborPose& pose) {
  const double now_s = swarm_.now_s();
  clients_.add(observer, pose, now_s);
  const double true_s = swarm_.robot(observer).recording.robot.clock.true_s(
      pose.stamp - swarm_.robot(observer).clock_shift);
  if (now_s - true_s > kOldest_s)
    complain(fmt::format("r{}: a pose of r{} is {:.3f} s old", observer.value, pose.neighbor.value,
                         now_s - true_s));
  const auto truth = study_.truth.relative(observer, pose.neighbor,
                                           pose.stamp - swarm_.robot(observer).clock_shift);
  if (truth) traces_.at({observer, pose.neighbor}).add(pose, *truth, now_s);
}

void Flight::check() {
  for (const VirtualRobot& robot : swarm_.robots()) {
    if (robot.state != VirtualRobot::State::kOn) {
      handed_[robot.id()].clear();
      continue;
    }
    check_datagrams(robot);
    check_readings(robot);
  }
  if (heap_before_ == 0) return;
  const std::uint64_t heap = static_cast<std::uint64_t>(test::heap_bytes());
  heap_growth_ = std::max(heap_growth_, heap - std::min(heap, heap_before_));
  if (heap_growth_ > kMostGrowth)
    complain(fmt::format("the heap has grown by {} bytes", heap_growth_));
}

/// Every datagram gave a report or was counted as one that gives none, our own aside.
void Flight::check_datagrams(const VirtualRobot& robot) {
  const MeshCounters& counters = robot.link.counters();
  const std::uint64_t received = counters[MeshCounter::kReceived];
  const std::uint64_t explained = robot.handed.reports + without_report(counters);
  if (received != explained)
    complain(fmt::format("r{}: {} of {} datagrams are not explained", robot.id().value,
                         received - explained, received));
  if (received + counters[MeshCounter::kRefusedOwnId] > robot.handed.datagrams)
    complain(fmt::format("r{}: more datagrams than arrived", robot.id().value));
}

/// What was handed to an estimator a while ago has a verdict.
void Flight::check_readings(const VirtualRobot& robot) {
  std::deque<Readings>& handed = handed_[robot.id()];
  handed.push_back({robot.handed.ranges, robot.handed.bearings, robot.handed.samples});
  if (handed.size() <= kPatience) return;
  const Readings then = handed.front();
  handed.pop_front();
  const EstimatorStatus status = robot.estimator.status();
  const auto judge = [&](std::string_view what, std::uint64_t count, std::uint64_t judged) {
    if (judged < count)
      complain(fmt::format("r{}: {} of {} {} have no verdict", robot.id().value, count - judged,
                           count, what));
  };
  judge("inertial samples", then.samples, robot.estimator.used_samples() + status.refused_samples);
  if (!counts_readings_) return;
  judge("ranges", then.ranges, verdicts(status, MeasurementKind::kRange));
  judge("bearings", then.bearings, verdicts(status, MeasurementKind::kBearing));
}

void Flight::complain(std::string what) {
  if (complaints_.size() < kMostComplaints)
    complaints_.push_back(fmt::format("{} at {:.1f} s", what, now_s_));
}

std::vector<std::string> Flight::complaints() const {
  std::vector<std::string> all = complaints_;
  all.insert(all.end(), clients_.complaints().begin(), clients_.complaints().end());
  return all;
}

}  // namespace crepes::faults
