#include "estimator/team/trust/team_faults.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "estimator/core/constants.hpp"
#include "estimator/core/quantile.hpp"
#include "estimator/team/trust/witnesses.hpp"

namespace crepes {
namespace {

// A misalignment is a fault beyond so many sigmas of its prior and of its estimate.
constexpr double kWrongPriors = 4.0;
constexpr double kWrongSigmas = 3.0;
constexpr double kLeastMisalignment = radians(0.1);  // rad
constexpr double kWrongClock = 8e-3;                 // s
constexpr Duration kSettling = std::chrono::seconds{2};

void add_camera_faults(const RobotCalibration& robot, std::vector<TeamFault>& faults) {
  using State = CameraMisalignment::State;
  for (const CameraMisalignment& camera : robot.cameras) {
    if (camera.state == State::kCalibrated) continue;
    const auto kind = camera.state == State::kRefused ? TeamFault::Kind::kCameraRefused
                                                      : TeamFault::Kind::kCameraTurned;
    faults.push_back({robot.robot, kind, camera.rotation.norm(), camera.angle_sigma_rad()});
  }
}

/// Soon after a robot was placed, it may be the place that is wrong.
bool is_settled(const TeamBelief& belief, RobotId id) {
  const TeamRobot& robot = belief.robots.at(id);
  return robot.is_trusted || belief.stamp - robot.since > kSettling;
}

/// A robot most of whose ranges, to at least two others, are refused.
void add_range_fault(const TeamBelief& belief, RobotId id, std::vector<TeamFault>& faults) {
  const OwnRanges own = own_ranges_of(belief, id, [&](const RobotPair& pair) {
    return is_settled(belief, pair.first) && is_settled(belief, pair.second);
  });
  if (own.are_false())
    faults.push_back({id, TeamFault::Kind::kRanges, own.sum_m / own.contradicted});
}

/// Clocks that differ from most others, this robot's among them.
void add_clock_faults(const TeamBelief& belief, std::vector<TeamFault>& faults) {
  if (belief.robots.size() < 3) return;
  std::vector<double> ahead_s;
  std::vector<double> variances;
  for (const auto& [id, robot] : belief.robots) {
    ahead_s.push_back(robot.clock_s);
    variances.push_back(belief.P(robot.clock_index(), robot.clock_index()));
  }
  std::vector<double> sorted_s = ahead_s;
  const double most_s = quantile(sorted_s, 0.5);
  std::vector<double> sorted_variances = variances;
  const double variance = quantile(sorted_variances, 0.5);
  for (std::size_t i = 0; const auto& [id, robot] : belief.robots) {
    const double size_s = robot.clock_s - most_s;
    const double sigma_s = std::sqrt(variances[i++] + variance);
    if (std::abs(size_s) > std::max(kWrongClock, kWrongSigmas * sigma_s))
      faults.push_back({id, TeamFault::Kind::kClock, size_s, sigma_s});
  }
}

}  // namespace

double believed_misalignment(const Priors& priors) {
  return std::max(priors.misalignment_rad, kLeastMisalignment);
}

bool is_turned(const CameraMisalignment& camera, const Priors& priors) {
  const double angle = camera.rotation.norm();
  const double sigma = std::sqrt(camera.covariance.diagonal().maxCoeff());
  return angle > kWrongPriors * believed_misalignment(priors) && angle > kWrongSigmas * sigma;
}

std::vector<RobotCalibration> calibrations_of(const TeamBelief& belief, const Priors& priors) {
  std::vector<RobotCalibration> calibrations;
  for (const auto& [id, robot] : belief.robots) {
    RobotCalibration one = belief.calibration(id);
    for (std::size_t i = 0; i < one.cameras.size(); ++i) {
      using State = CameraMisalignment::State;
      CameraMisalignment& camera = one.cameras[i];
      if (is_turned(camera, priors)) camera.state = State::kTurned;
      if (robot.cameras[i].is_refused) camera.state = State::kRefused;
    }
    calibrations.push_back(std::move(one));
  }
  return calibrations;
}

std::vector<TeamFault> faults_of(const TeamBelief& belief,
                                 const std::vector<RobotCalibration>& calibrations) {
  std::vector<TeamFault> faults;
  for (const RobotCalibration& robot : calibrations) {
    add_camera_faults(robot, faults);
    add_range_fault(belief, robot.robot, faults);
  }
  add_clock_faults(belief, faults);
  return faults;
}

}  // namespace crepes
