#include "tests/faults/trial.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>

#include "daemon/ctl/replay/swarm_replay.hpp"
#include "tests/faults/network_faults.hpp"
#include "tests/faults/sensor_faults.hpp"
#include "tests/study/simulated_swarm.hpp"

namespace crepes::faults {
namespace {

constexpr int kRobots = 4;
constexpr std::array<std::string_view, 3> kScenarioNames{"four", "occluded", "cluttered"};
constexpr double kBeyond5Sigma = 35.0;  // Mahalanobis^2 of the position
constexpr double kLongestBeyond_s = 0.5;
constexpr double kLongestGap_s = 0.1;  // between poses that follow each other
constexpr double kLongestAbsence_s = 0.5;

/// The poses of one pair as they are published.
class Judge {
 public:
  Judge(const study::Swarm& swarm, Pair pair, double recovered_s)
      : swarm_(swarm), pair_(pair), recovered_s_(recovered_s), last_s_(recovered_s) {}

  void add(const NeighborPose& pose) {
    const Vector7 numbers = numbers_of(pose);
    outcome_.not_finite += numbers.allFinite() && pose.T_B_N.covariance.allFinite() ? 0 : 1;
    for (const double number : numbers)
      outcome_.hash = outcome_.hash * 1099511628211U ^ std::bit_cast<std::uint64_t>(number);
    const auto truth = swarm_.truth.relative(pair_.first, pair_.second, pose.stamp);
    if (!truth) return;
    const RobotClock& clock = study::recording_of(swarm_.dataset, pair_.first).robot.clock;
    const double true_s = clock.true_s(pose.published);
    const Eigen::Vector3d error = pose_difference(pose.T_B_N.pose, *truth).head<3>();
    const Eigen::Matrix3d P = pose.T_B_N.covariance.topLeftCorner<3, 3>();
    judge_honesty(true_s, error, P);
    if (true_s < recovered_s_) return;
    outcome_.longest_absence_s = std::max(outcome_.longest_absence_s, true_s - last_s_);
    last_s_ = true_s;
    square_ += error.squaredNorm();
    ++count_;
  }

  [[nodiscard]] PairOutcome outcome() const {
    PairOutcome outcome = outcome_;
    outcome.longest_absence_s = std::max(outcome.longest_absence_s, kDuration_s - 0.5 - last_s_);
    outcome.rmse_m = count_ == 0 ? 0.0 : std::sqrt(square_ / static_cast<double>(count_));
    return outcome;
  }

 private:
  using Vector7 = Eigen::Matrix<double, 7, 1>;
  static Vector7 numbers_of(const NeighborPose& pose) {
    Vector7 numbers;
    numbers << pose.T_B_N.pose.p, pose.T_B_N.pose.q.coeffs();
    return numbers;
  }

  void judge_honesty(double true_s, const Eigen::Vector3d& error, const Eigen::Matrix3d& P) {
    const bool is_beyond = !(error.dot(P.llt().solve(error)) <= kBeyond5Sigma);
    const bool goes_on = is_beyond && beyond_since_ && true_s - latest_s_ < kLongestGap_s;
    if (!goes_on) beyond_since_ = is_beyond ? std::optional(true_s) : std::nullopt;
    latest_s_ = true_s;
    if (!beyond_since_) return;
    outcome_.longest_beyond_s = std::max(outcome_.longest_beyond_s, true_s - *beyond_since_);
    outcome_.worst_beyond_m = std::max(outcome_.worst_beyond_m, error.norm());
  }

  const study::Swarm& swarm_;
  Pair pair_;
  double recovered_s_;
  double last_s_;
  double latest_s_ = 0.0;
  std::optional<double> beyond_since_;
  double square_ = 0.0;
  std::size_t count_ = 0;
  PairOutcome outcome_;
};

/// Whether a fault makes this pair's poses wrong: one of the two is faulty.
bool is_excused(const std::vector<Fault>& faults, const Pair& pair) {
  return std::ranges::any_of(faults, [&](const Fault& fault) {
    return about(fault.kind).scope == Scope::kRobot &&
           (fault.robot == pair.first || fault.robot == pair.second);
  });
}

std::string text_of(const Pair& pair) {
  return fmt::format("r{} -> r{}", pair.first.value, pair.second.value);
}

}  // namespace

double recovered_s(const std::vector<Fault>& faults) {
  double last_s = kFirstFault_s;
  for (const Fault& fault : faults) last_s = std::max(last_s, fault.to_s);
  return last_s + kRecovery_s;
}

Outcome run(const study::Swarm& swarm, const std::vector<Fault>& faults, double recovered_s) {
  SwarmDataset dataset = swarm.dataset;
  for (const Fault& fault : faults) apply_to_sensors(fault, dataset);
  std::map<Pair, Judge> judges;
  for (const RobotRecording& from : dataset.robots) {
    for (const RobotRecording& to : dataset.robots) {
      const Pair pair{from.robot.id, to.robot.id};
      if (pair.first != pair.second) judges.try_emplace(pair, swarm, pair, recovered_s);
    }
  }
  ReplaySinks sinks;
  sinks.on_pose = [&](RobotId observer, const NeighborPose& pose) {
    judges.at({observer, pose.neighbor}).add(pose);
  };
  sinks.on_report = [&](Report& report) {
    const RobotClock& clock = study::recording_of(swarm.dataset, report.sender).robot.clock;
    corrupt_report(faults, clock.true_s(report.stamp), report);
  };
  sinks.on_delivery = FaultyNetwork(faults, faults.empty() ? 0 : faults.front().seed);
  ReplayOptions options;
  options.outages = outages_of(faults);
  const auto report = replay_dataset(std::move(dataset), std::nullopt, options, sinks);
  if (!report) {
    fmt::print(stderr, "{}\n", report.error().message);
    std::abort();
  }
  Outcome outcome;
  for (const auto& [pair, judge] : judges) outcome[pair] = judge.outcome();
  return outcome;
}

std::vector<std::string> broken_promises(const std::vector<Fault>& faults, const Outcome& outcome,
                                         const Outcome& reference) {
  std::vector<std::string> broken;
  for (const auto& [pair, found] : outcome) {
    const PairOutcome& without = reference.at(pair);
    if (found.not_finite > 0)
      broken.push_back(fmt::format("{}: {} poses not finite", text_of(pair), found.not_finite));
    if (found.longest_beyond_s > kLongestBeyond_s && !is_excused(faults, pair)) {
      broken.push_back(fmt::format("{}: beyond 5 sigma for {:.2f} s, up to {:.2f} m", text_of(pair),
                                   found.longest_beyond_s, found.worst_beyond_m));
    }
    if (found.longest_absence_s > std::max(kLongestAbsence_s, without.longest_absence_s + 0.1)) {
      broken.push_back(fmt::format("{}: no pose for {:.2f} s after the recovery", text_of(pair),
                                   found.longest_absence_s));
    }
    // Calibration that was learned before the fault may have to be learned anew.
    const double allowed = 2.0 * without.rmse_m + 0.03;
    if (found.rmse_m > allowed) {
      broken.push_back(fmt::format("{}: error {:.3f} m after the recovery, {:.3f} m without faults",
                                   text_of(pair), found.rmse_m, without.rmse_m));
    }
  }
  return broken;
}

Verdict try_seed(std::uint64_t seed) {
  const study::Scenario& scenario = *std::ranges::find(
      study::kScenarios, kScenarioNames.at(seed % kScenarioNames.size()), &study::Scenario::name);
  const study::Swarm swarm = study::simulate_swarm(scenario, static_cast<int>(seed), kDuration_s);
  std::vector<Fault> faults = draw_faults(seed, kRobots, kFirstFault_s, kLastFault_s);
  const auto broken_by = [&](const std::vector<Fault>& some) {
    const double from_s = recovered_s(some);
    return broken_promises(some, run(swarm, some, from_s), run(swarm, {}, from_s));
  };
  std::vector<std::string> broken = broken_by(faults);
  for (std::size_t i = 0; !broken.empty() && faults.size() > 1 && i < faults.size();) {
    std::vector<Fault> fewer = faults;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(i));
    if (auto still = broken_by(fewer); still.empty()) {
      ++i;
    } else {
      faults = std::move(fewer);
      broken = std::move(still);
    }
  }
  return {std::move(faults), std::move(broken)};
}

}  // namespace crepes::faults
