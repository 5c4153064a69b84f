#include "estimator/calibration/swarm/swarm_refusal.hpp"

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

double longest_gap(const std::vector<ImuSample>& imu) {
  double gap_s = 0.0;
  for (std::size_t i = 1; i < imu.size(); ++i)
    gap_s = std::max(gap_s, to_seconds(imu[i].stamp - imu[i - 1].stamp));
  return gap_s;
}

std::size_t times_seen(const std::vector<RobotRecord>& records, std::size_t robot) {
  std::size_t count = 0;
  for (const RobotRecord& record : records)
    count += static_cast<std::size_t>(
        std::ranges::count(record.sightings, robot, &BoardSighting::board));
  return count;
}

void check_robot(const std::vector<RobotRecord>& records, std::size_t r, const std::string& name,
                 std::vector<std::string>& reasons) {
  const std::vector<ImuSample>& imu = records[r].imu;
  const std::string least = ", at least " + std::to_string(kLeastSwarmSightings) + " are needed";
  if (imu.size() < 2) {
    reasons.push_back(name + " has no inertial samples");
  } else if (const double gap_s = longest_gap(imu); gap_s > kLongestSwarmGap_s) {
    reasons.push_back(name + " has a gap of " + number_text(gap_s, 2) +
                      " s in its inertial samples");
  }
  if (const std::size_t own = records[r].sightings.size(); own < kLeastSwarmSightings)
    reasons.push_back(name + " sees others " + std::to_string(own) + " times" + least +
                      ": fly in view of its camera");
  if (const std::size_t seen = times_seen(records, r); seen < kLeastSwarmSightings)
    reasons.push_back(name + " is seen by others " + std::to_string(seen) + " times" + least +
                      ": is its pattern in swarm.members, and its board lit?");
}

void judge_robot(const RobotCalibration& robot, const std::string& name, SwarmBatchResult& result) {
  if (robot.spot_sigma_px > kMostSwarmSpotSigma_px)
    result.refusals.push_back("residuals of " + number_text(robot.spot_sigma_px, 2) + " px in " +
                              name +
                              "'s camera: its lens is no Double Sphere, its time stamps "
                              "jitter, or the picture is blurred");
  if (robot.outliers > kMostSwarmOutliers)
    result.refusals.push_back(number_text(100.0 * robot.outliers, 0) + " % of " + name +
                              "'s sightings contradict the others");
  const double turn = robot.sigma.segment<3>(swarm_at::kRotation).maxCoeff();
  if (turn > kMostRotationSigma)
    result.refusals.push_back(name + "'s camera remains uncertain by " +
                              number_text(turn * kDegPerRad, 2) +
                              " deg (one sigma): turn and tilt it more, while it sees others");
  for (int i = 0; i < swarm_at::kClock; ++i) {
    const bool is_of_imu = i >= swarm_at::kGyroMatrix && i < swarm_at::kRing;
    if (is_of_imu || robot.is_determined(i)) continue;
    result.warnings.push_back(name +
                              ": this flight does not determine all; what is marked keeps its "
                              "prior");
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
    return {std::to_string(records.size()) + " robots, at most " + std::to_string(kMostRobots) +
            " can be calibrated at once: record them in groups"};
  for (std::size_t r = 0; r < records.size(); ++r) {
    check_robot(records, r, names[r], reasons);
    if (r != start.reference && start.poses[r].empty())
      reasons.push_back("the present calibration gives no pose of " + names[r] + " by " +
                        names[start.reference] +
                        " to start from: run calibrate camera on both first");
  }
  return reasons;
}

std::vector<std::string> refusals_of_length(double seconds) {
  if (seconds >= kLeastSwarm_s) return {};
  return {"all robots have poses for " + number_text(std::max(0.0, seconds), 0) +
          " s only; record half a minute or more"};
}

void judge_swarm(const SwarmSolution& solution, const std::vector<std::string>& names,
                 SwarmBatchResult& result) {
  if (solution.covariance.size() == 0) {
    result.refusals.emplace_back("the recording does not determine the swarm");
    return;
  }
  for (std::size_t r = 0; r < names.size(); ++r) judge_robot(result.robots[r], names[r], result);
  if (solution.range_outliers > kMostRangeOutliers)
    result.refusals.push_back(number_text(100.0 * solution.range_outliers, 0) +
                              " % of the ranges contradict the others: something stood between the "
                              "modules");
  if (!solution.has_converged)
    result.warnings.emplace_back("the solver had not converged when it stopped");
}

}  // namespace crepes
