/// The first guess of a camera calibration, from next to nothing.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "estimator/calibration/camera/camera_problem.hpp"
#include "estimator/calibration/camera/camera_state.hpp"
#include "estimator/core/measurements.hpp"

namespace crepes {

/// A generic fisheye: xi -0.2, alpha 0.6, centered, whose image circle of `fov_rad` touches the
/// nearer border of the image.
[[nodiscard]] LensVector generic_lens(int width, int height, double fov_rad);

/// The unit direction that `uv` sees, camera axes. Empty outside the image circle.
[[nodiscard]] std::optional<Eigen::Vector3d> direction_of(const LensVector& lens,
                                                          const Eigen::Vector2d& uv);

/// The rotation between camera and body.
struct HandEye {
  Eigen::Quaterniond q_C_B = Eigen::Quaterniond::Identity();
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
};

/// The rotation nearest to A of  w_C = A w_B - c , and the bias that c means.
[[nodiscard]] HandEye hand_eye_of(const Eigen::Matrix3d& A, const Eigen::Vector3d& c);

/// From  du/dt = u x (A w - c)  of boards that are far away, A = R_C_B, c = R_C_B bias: linear
/// least squares, then the nearest rotation. Empty with too few sightings.
[[nodiscard]] std::optional<HandEye> align_camera(std::span<const ImuSample> imu,
                                                  std::span<const BoardSighting> sightings,
                                                  const LensVector& lens);

/// The whole state: attitude by the gyroscope, levelled by gravity; the body stays at the origin;
/// each board 3 m away where it is seen on average.
[[nodiscard]] CameraState first_state(const CameraProblem& problem, std::span<const ImuSample> imu,
                                      std::size_t boards, const CameraConstants& guess,
                                      const Eigen::Vector3d& gyro_bias);

}  // namespace crepes
