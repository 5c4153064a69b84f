/// What the calibration of a whole swarm estimates.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "estimator/calibration/batch/arrow_system.hpp"
#include "estimator/calibration/camera/camera_state.hpp"
#include "estimator/core/sensor_noise.hpp"

namespace crepes {

/// The order of a robot's constants in normal equations. The first 28 are those of
/// `camera_constants`: lens, R_C_B, p_B_C, time shift, gyroscope and accelerometer matrix. Then the
/// LED ring and the antenna in the body, antenna delay, offset and skew of the clock.
namespace swarm_constants {
inline constexpr int kLens = camera_constants::kLens;
inline constexpr int kRotation = camera_constants::kRotation;
inline constexpr int kPosition = camera_constants::kPosition;
inline constexpr int kShift = camera_constants::kShift;
inline constexpr int kGyroMatrix = camera_constants::kGyroMatrix;
inline constexpr int kAccelMatrix = camera_constants::kAccelMatrix;
inline constexpr int kRing = camera_constants::kBoards;
inline constexpr int kAntenna = 31;
inline constexpr int kDelay = 34;
inline constexpr int kClock = 35;
inline constexpr int kSkew = 36;
inline constexpr int kSize = 37;
}  // namespace swarm_constants

/// Everything of a robot that does not change during the recording.
struct RobotConstants {
  CameraConstants camera;                           ///< without boards
  Eigen::Vector3d p_B_M = Eigen::Vector3d::Zero();  ///< LED ring
  Eigen::Vector3d p_B_U = Eigen::Vector3d::Zero();  ///< UWB antenna
  double range_delay_m = 0.0;                       ///< lengthens all ranges of its module
  double clock_s = 0.0;                             ///< its stamps are ahead by so much
  double clock_skew = 0.0;                          ///< and gain so much a second

  /// The common time of a stamp of this robot, and the stamp of a common time [s].
  [[nodiscard]] double common_s(double stamp_s) const {
    return (1.0 - clock_skew) * stamp_s - clock_s;
  }
  [[nodiscard]] double stamp_s(double common_s) const {
    return (1.0 + clock_skew) * common_s + clock_s;
  }
};

/// Where a robot's constants begin among all constants; for the number of robots, where those of
/// the pairs do.
[[nodiscard]] constexpr int constants_index(std::size_t robot) {
  return static_cast<int>(robot) * swarm_constants::kSize;
}
/// Where a robot's body begins in a knot of all robots; for the number of robots, where the pairs'
/// drifts do.
[[nodiscard]] constexpr int body_index(std::size_t robot) {
  return static_cast<int>(robot) * ArrowSystem::kState;
}

/// Pairs of robots, each once: (0, 1), (0, 2), ..., (1, 2), ...
[[nodiscard]] constexpr std::size_t pair_count(std::size_t robots) {
  return robots * (robots - 1) / 2;
}
[[nodiscard]] constexpr std::size_t pair_index(std::size_t a, std::size_t b, std::size_t robots) {
  const std::size_t low = a < b ? a : b;
  const std::size_t high = a < b ? b : a;
  return low * (2 * robots - low - 1) / 2 + (high - low - 1);
}

/// Knots of all robots stand at the same times, but for half an IMU sample. What both delays do not
/// explain of a pair's ranges is a constant and a drift. In normal equations they follow the
/// constants and the knots of all robots.
struct SwarmState {
  std::vector<RobotConstants> robots;
  std::vector<std::vector<CameraKnot>> knots;     ///< by robot
  std::vector<double> pair_bias_m;                ///< by `pair_index`
  std::vector<std::vector<double>> pair_drift_m;  ///< by knot and `pair_index`
};

/// One-sigma priors of a robot's constants, in the order of `swarm_constants`.
using RobotPriors = Eigen::Matrix<double, swarm_constants::kSize, 1>;

/// What a configuration by ruler and data sheet is off by: 3 cm, 6 deg, a lens by 2 %, antenna
/// delays of 0.2 m. The IMU's scales and axes are known as its `noise` says. `focal_px` is that of
/// the lens.
[[nodiscard]] RobotPriors default_robot_priors(double focal_px, const ImuNoise& noise);

/// `state` moved by `step`.
[[nodiscard]] SwarmState moved(const SwarmState& state, const TeamArrowSystem::Step& step);

/// What moves `from` to `to`: the constants' error, in the order of `swarm_constants`.
[[nodiscard]] RobotPriors difference(const RobotConstants& from, const RobotConstants& to);

}  // namespace crepes
