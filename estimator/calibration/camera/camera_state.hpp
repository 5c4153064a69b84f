/// What a camera calibration estimates.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "estimator/calibration/batch/arrow_system.hpp"
#include "estimator/core/pose.hpp"

namespace crepes {

/// The order of the constants in normal equations: Double Sphere [xi, alpha, fx, fy, cx, cy],
/// R_C_B (right perturbation), p_B_C, time shift, gyroscope matrix by rows, accelerometer matrix
/// (upper triangle by rows), then the boards: as many as `board_unknowns` says.
namespace camera_constants {
inline constexpr int kLens = 0;
inline constexpr int kRotation = 6;
inline constexpr int kPosition = 9;
inline constexpr int kShift = 12;
inline constexpr int kGyroMatrix = 13;
inline constexpr int kAccelMatrix = 22;
inline constexpr int kBoards = 28;
}  // namespace camera_constants

using LensVector = Eigen::Matrix<double, 6, 1>;

/// Whether boards stand anywhere, or are the LEDs of one rigid grid.
enum class BoardLayout : std::uint8_t { kFree, kRigid };

/// See `board_unknowns`; the scale is the last.
inline constexpr int kRigidUnknowns = 7;

/// Everything that does not change during the recording.
struct CameraConstants {
  LensVector lens = LensVector::Zero();  ///< xi, alpha, fx, fy, cx, cy
  Eigen::Quaterniond q_C_B = Eigen::Quaterniond::Identity();
  Eigen::Vector3d p_B_C = Eigen::Vector3d::Zero();
  double shift_s = 0.0;                                   ///< t_imu = t_cam + shift
  Eigen::Matrix3d M_gyro = Eigen::Matrix3d::Identity();   ///< corrected = M (measured - bias)
  Eigen::Matrix3d M_accel = Eigen::Matrix3d::Identity();  ///< upper triangular
  std::vector<Eigen::Vector3d> p_W;                       ///< the boards
  BoardLayout layout = BoardLayout::kFree;
  double layout_scale = 1.0;  ///< of a rigid layout, over the size that was said

  /// Kalibr's T_cam_imu.
  [[nodiscard]] Pose T_C_B() const { return {-(q_C_B * p_B_C), q_C_B}; }
};

/// Free boards have three unknowns each. A rigid layout has seven: a rotation about its first board
/// (left, world axes), that board's place, and the logarithm of its scale.
[[nodiscard]] inline int board_unknowns(const CameraConstants& constants) {
  return constants.layout == BoardLayout::kRigid ? kRigidUnknowns
                                                 : 3 * static_cast<int>(constants.p_W.size());
}

/// The body and its IMU's biases at one instant; world z is up.
struct CameraKnot {
  Eigen::Quaterniond q_W_B = Eigen::Quaterniond::Identity();
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();
};

/// Error order of a knot: [theta (right), v, p, gyro bias, accel bias].
struct CameraState {
  CameraConstants constants;
  std::vector<CameraKnot> knots;
};

/// `state` moved by `step`.
[[nodiscard]] CameraState moved(const CameraState& state, const ArrowSystem::Step& step);

}  // namespace crepes
