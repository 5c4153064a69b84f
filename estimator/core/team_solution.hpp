/// What the team's filter answers: poses, calibrations, residuals, faults.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "estimator/core/measurements.hpp"

namespace crepes {

/// One robot as the team's filter knows it, in this robot's body frame.
struct TeamPose {
  static constexpr int kMotion = 9;  ///< [p, v, theta], theta a right perturbation
  static constexpr int kBiases = 12;
  using Covariance = Eigen::Matrix<double, kMotion + kBiases, kMotion + kBiases>;

  RobotId neighbor{};
  Pose T_B_N;
  Eigen::Vector3d v_B_N = Eigen::Vector3d::Zero();  ///< R_W_B^T (v_W_N - v_W_B) [m/s]
  /// Of the motion, and of the IMUs' biases: gyroscope and accelerometer of B, then of N.
  Covariance covariance = Covariance::Zero();
  Timestamp last_sighting = kNever;  ///< when anybody saw it, or it anybody, or ranges located it
  Timestamp since = kNever;          ///< it was placed anew then
  Duration clock_ahead{};            ///< its sensors' stamps are so much ahead of this robot's
  bool needs_confirmation = false;   ///< not to be used unless another estimate of it agrees
  /// A camera of one of the two was knocked out of its calibration. Their pair's filter does not
  /// know that, so it says nothing against this pose.
  bool was_knocked = false;

  [[nodiscard]] Matrix6d pose_covariance() const {
    Matrix6d of_pose;
    of_pose << covariance.block<3, 3>(0, 0), covariance.block<3, 3>(0, 6),
        covariance.block<3, 3>(6, 0), covariance.block<3, 3>(6, 6);
    return of_pose;
  }
};

/// What the team's filter knows of a robot's IMU. Sigmas are those of the axes.
struct ImuBiasEstimate {
  Eigen::Vector3d gyro_radps = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_mps2 = Eigen::Vector3d::Zero();
  Eigen::Matrix3d gyro_scale = Eigen::Matrix3d::Zero();  ///< the rate reads (I + scale) w + bias
  Eigen::Vector3d gyro_sigma_radps = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_sigma_mps2 = Eigen::Vector3d::Zero();
  Eigen::Matrix3d gyro_scale_sigma = Eigen::Matrix3d::Zero();
};

/// How far a camera points from where its calibration says.
struct CameraMisalignment {
  /// What the team makes of it.
  enum class State : std::uint8_t {
    kCalibrated,
    kTurned,   ///< significantly, and beyond what a calibration leaves
    kRefused,  ///< it contradicts the team whatever its misalignment
  };

  Eigen::Vector3d p_B_C = Eigen::Vector3d::Zero();
  /// Rotation vector, in body axes, from a direction by the calibration to the one measured [rad].
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  /// What its lens adds: all directions are moved towards this point, in body axes [rad], by the
  /// part of it across.
  Eigen::Vector3d lens = Eigen::Vector3d::Zero();
  Eigen::Vector3d lens_sigma = Eigen::Vector3d::Zero();
  State state = State::kCalibrated;

  /// One sigma of the angle, about the axis of the rotation.
  [[nodiscard]] double angle_sigma_rad() const {
    const double angle = rotation.norm();
    if (angle == 0.0) return std::sqrt(covariance.diagonal().maxCoeff());
    return std::sqrt(rotation.dot(covariance * rotation)) / angle;
  }
};

/// As it is called in STATUS.
[[nodiscard]] constexpr std::string_view name_of(CameraMisalignment::State state) {
  constexpr std::array<std::string_view, 3> kNames{"calibrated", "turned", "left_out"};
  return kNames[static_cast<std::size_t>(state)];
}

/// What the team's filter knows of a robot's sensors.
struct RobotCalibration {
  RobotId robot{};
  bool is_trusted = false;  ///< false: on probation
  ImuBiasEstimate imu;
  double antenna_delay_m = 0.0;  ///< lengthens all ranges of its module
  double antenna_delay_sigma_m = 0.0;
  double clock_s = 0.0;  ///< its sensors' stamps are so much ahead of this robot's
  double clock_sigma_s = 0.0;
  std::vector<CameraMisalignment> cameras;  ///< in the order of their first bearings
};

/// What a robot measured within an interval, against what the team expected before it was fused.
struct TeamResidual {
  /// Which sensor.
  enum class Kind : std::uint8_t {
    kBearing,  ///< of one of its cameras to one neighbor
    kRange,    ///< of its module to one neighbor
    kGyro,     ///< its rate, against the change of all that its cameras see
  };

  RobotId observer{};
  RobotId neighbor{};  ///< the observer itself for kGyro
  Kind kind = Kind::kBearing;
  int camera = 0;   ///< of `RobotCalibration::cameras`
  int fused = 0;    ///< readings; intervals for kGyro
  int refused = 0;  ///< likewise
  /// Of the mean of those that were fused, or of all if none was: residual^T S^-1 residual.
  double nis = 0.0;
  int dimension = 0;                 ///< 0: there was no residual
  std::array<double, 2> residual{};  ///< bearings [rad], ranges [m]; none for kGyro
  std::array<double, 2> sigma{};     ///< roots of S's diagonal
};
inline constexpr std::size_t kTeamResidualKindCount = 3;

/// As it is called in STATUS and in files.
[[nodiscard]] constexpr std::string_view name_of(TeamResidual::Kind kind) {
  constexpr std::array<std::string_view, kTeamResidualKindCount> kNames{"bearing", "range", "gyro"};
  return kNames[static_cast<std::size_t>(kind)];
}

/// A robot whose sensors contradict the rest of the team.
struct TeamFault {
  /// What is wrong, and what becomes of its measurements.
  enum class Kind : std::uint8_t {
    kCameraTurned,   ///< its bearings are used with the misalignment that the team found
    kCameraRefused,  ///< it contradicts the team whatever its misalignment
    kRanges,         ///< its ranges are refused
    kClock,          ///< its stamps are used with the offset that the team found
    kGyro,           ///< it reads other rates than its cameras show; the robot is left out
    kEstimates,      ///< it broadcasts poses of others that are wrong; nobody uses them
    kModule,         ///< another robot carries the UWB module of its id; ranges to it are refused
    kMounting,       ///< its IMU is not mounted as configured; nothing of the robot is used
  };
  RobotId robot{};
  Kind kind = Kind::kCameraTurned;
  /// [rad] of a camera, [m] of ranges, positive if they are too long, [s] of a clock, positive if
  /// it is ahead, [rad/s] of a gyroscope, [m] of estimates, [m] to where the
  /// module is, [rad] of a mounting.
  double size = 0.0;
  double sigma = 0.0;  ///< of a turned camera's and of a clock's size

  [[nodiscard]] bool operator==(const TeamFault&) const = default;
};

/// The team's answer, in this robot's body frame at `stamp`.
struct TeamSolution {
  Timestamp stamp{};
  std::vector<TeamPose> poses;                 ///< ordered by neighbor
  std::vector<RobotCalibration> calibrations;  ///< of those estimated jointly, with this robot
  std::vector<TeamResidual> residuals;         ///< of the interval that ends at `stamp`
  std::vector<TeamFault> faults;
};

}  // namespace crepes
