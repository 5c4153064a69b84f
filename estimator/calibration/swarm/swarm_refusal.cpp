#include "estimator/calibration/swarm/swarm_refusal.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "estimator/calibration/number_text.hpp"
#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

namespace swarm_at = swarm_constants;

constexpr std::size_t kMostRobots = 6;  // a step's cost grows with the cube
constexpr std::size_t kLeastSwarmSightings = 300;
constexpr double kLeastSwarm_s = 10.0;
constexpr double kLongestSwarmGap_s = 0.05;
constexpr double kMostSwarmSpotSigma_px = 2.0;
constexpr double kMostSwarmOutliers = 0.3;  // of a camera's sightings
constexpr double kMostRangeOutliers = 0.4;
constexpr double kMostRotationSigma = radians(0.5);

/// Of those that reach into [from, to].
double longest_gap(const std::vector<ImuSample>& imu, Timestamp from, Timestamp to) {
  double gap_s = 0.0;
  for (std::size_t i = 1; i < imu.size(); ++i) {
    if (imu[i].stamp > from && imu[i - 1].stamp < to)
      gap_s = std::max(gap_s, to_seconds(imu[i].stamp - imu[i - 1].stamp));
  }
  return gap_s;
}

std::size_t times_seen(const std::vector<RobotRecord>& records, std::size_t robot) {
  std::size_t count = 0;
  for (const RobotRecord& record : records)
    count += static_cast<std::size_t>(
        std::ranges::count(record.sightings, robot, &BoardSighting::board));
  return count;
}

void check_sightings(const std::vector<RobotRecord>& records, std::size_t r,
                     const std::string& name, std::vector<std::string>& reasons) {
  if (const std::size_t own = records[r].sightings.size(); own < kLeastSwarmSightings)
    reasons.push_back(
        fmt::format("{} sees others {} times, at least {} are needed: fly in view of its camera",
                    name, own, kLeastSwarmSightings));
  if (const std::size_t seen = times_seen(records, r); seen < kLeastSwarmSightings)
    reasons.push_back(fmt::format(
        "{} is seen by others {} times, at least {} are needed: is its pattern in swarm.members, "
        "and its board lit?",
        name, seen, kLeastSwarmSightings));
}

void judge_robot(const CalibratedRobot& robot, const std::string& name, SwarmBatchResult& result) {
  if (robot.spot_sigma_px > kMostSwarmSpotSigma_px)
    result.refusals.push_back(fmt::format(
        "residuals of {} px in {}'s camera: its lens is no Double Sphere, its time stamps jitter, "
        "or the picture is blurred",
        number_text(robot.spot_sigma_px, 2), name));
  if (robot.outliers > kMostSwarmOutliers)
    result.refusals.push_back(fmt::format("{} % of {}'s sightings contradict the others",
                                          number_text(100.0 * robot.outliers, 0), name));
  const double turn = robot.sigma.segment<3>(swarm_at::kRotation).maxCoeff();
  if (turn > kMostRotationSigma)
    result.refusals.push_back(fmt::format(
        "{}'s camera remains uncertain by {} deg (one sigma): turn and tilt it more, while it sees "
        "others",
        name, number_text(turn * kDegPerRad, 2)));
  for (int i = 0; i < swarm_at::kClock; ++i) {
    const bool is_of_imu = i >= swarm_at::kGyroMatrix && i < swarm_at::kRing;
    if (is_of_imu || robot.is_determined(i)) continue;
    result.warnings.push_back(fmt::format(
        "{}: this flight does not determine all; what is marked keeps its prior", name));
    break;
  }
}

}  // namespace

std::vector<std::string> refusals_before_fit(const std::vector<RobotRecord>& records,
                                             const SwarmStart& start,
                                             const std::vector<std::string>& names) {
  std::vector<std::string> reasons;
  if (records.size() < 2) return {"one robot alone: two or more must see each other"};
  if (records.size() > kMostRobots)
    return {fmt::format("{} robots, at most {} can be calibrated at once: record them in groups",
                        records.size(), kMostRobots)};
  for (std::size_t r = 0; r < records.size(); ++r) {
    if (records[r].imu.size() < 2)
      reasons.push_back(fmt::format("{} has no inertial samples", names[r]));
    if (r != start.reference && start.poses[r].empty())
      reasons.push_back(fmt::format(
          "the present calibration gives no pose of {} by {} to start from: run calibrate camera "
          "on both first",
          names[r], names[start.reference]));
  }
  return reasons;
}

std::vector<std::string> refusals_of_window(const std::vector<RobotRecord>& records, Timestamp from,
                                            Timestamp to, const std::vector<std::string>& names) {
  if (const double seconds = to_seconds(to - from); seconds < kLeastSwarm_s) {
    return {fmt::format("all robots have poses for {} s only; record half a minute or more",
                        number_text(std::max(0.0, seconds), 0))};
  }
  std::vector<std::string> reasons;
  for (std::size_t r = 0; r < records.size(); ++r) {
    if (const double gap_s = longest_gap(records[r].imu, from, to); gap_s > kLongestSwarmGap_s) {
      reasons.push_back(fmt::format("{} has a gap of {} s in its inertial samples", names[r],
                                    number_text(gap_s, 2)));
    }
    check_sightings(records, r, names[r], reasons);
  }
  return reasons;
}

void judge_swarm(const SwarmSolution& solution, const std::vector<std::string>& names,
                 SwarmBatchResult& result) {
  if (solution.covariance.size() == 0) {
    result.refusals.emplace_back("the recording does not determine the swarm");
    return;
  }
  for (std::size_t r = 0; r < names.size(); ++r) judge_robot(result.robots[r], names[r], result);
  if (solution.range_outliers > kMostRangeOutliers)
    result.refusals.push_back(
        fmt::format("{} % of the ranges contradict the others: something stood between the modules",
                    number_text(100.0 * solution.range_outliers, 0)));
  if (!solution.has_converged)
    result.warnings.emplace_back("the solver had not converged when it stopped");
}

}  // namespace crepes
