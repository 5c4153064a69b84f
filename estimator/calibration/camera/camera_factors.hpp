/// What an IMU's samples say of the next knot, and what a camera shows of a board.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "estimator/calibration/batch/arrow_system.hpp"
#include "estimator/calibration/batch/jet.hpp"
#include "estimator/calibration/batch/jet_geometry.hpp"
#include "estimator/calibration/camera/camera_state.hpp"
#include "estimator/calibration/camera/local_state.hpp"

namespace crepes {

/// With derivatives by the parameters of an interval.
using LocalJet = ceres::Jet<double, local_columns::kSize>;

/// Carries a body over a step in which it accelerates by `a_W` [m/s^2].
template <class T>
void advance(const InertialStep<T>& step, const Vector3<T>& a_W, Motion<T>& motion) {
  const T dt(step.dt);
  motion.p_W += motion.v_W * dt + a_W * (T(0.5) * dt * dt);
  motion.v_W += a_W * dt;
  const Vector3<T> phi = step.angle(dt);
  for (int row = 0; row < 3; ++row) {
    const Vector3<T> axis = motion.R_W_B.row(row).transpose();
    motion.R_W_B.row(row) = rotated<T>(-phi, axis).transpose();
  }
}

/// What is between where an interval ends and the next knot, in its error order. Not whitened.
template <class T>
[[nodiscard]] Eigen::Matrix<T, ArrowSystem::kState, 1> knot_residual(const LocalState<T>& end,
                                                                     const CameraKnot& next) {
  Eigen::Matrix<T, ArrowSystem::kState, 1> r;
  const Matrix3<T> error =
      end.motion.R_W_B.transpose() * next.q_W_B.toRotationMatrix().template cast<T>();
  r << small_log<T>(error), next.v_W.cast<T>() - end.motion.v_W,
      next.p_W.cast<T>() - end.motion.p_W, next.gyro_bias.cast<T>() - end.gyro_bias,
      next.accel_bias.cast<T>() - end.accel_bias;
  return r;
}

/// From the world to the camera at an instant:  p_C = R_C_W p_W + t_C .
template <class T>
struct CameraAt {
  Matrix3<T> R_C_W;
  Vector3<T> t_C;
};

/// After `tau` of a step in which the body accelerates by `a_W` [m/s^2].
template <class T>
[[nodiscard]] CameraAt<T> camera_at(const LocalState<T>& local, const InertialStep<T>& step,
                                    const Vector3<T>& a_W, const T& tau) {
  const Vector3<T> p_W = local.motion.p_W + local.motion.v_W * tau + a_W * (0.5 * tau * tau);
  const Vector3<T> phi = step.angle(tau);
  Matrix3<T> R_B_W;
  for (int i = 0; i < 3; ++i) {
    const Vector3<T> axis = local.motion.R_W_B.row(i).transpose();
    R_B_W.col(i) = rotated<T>(-phi, axis);
  }
  CameraAt<T> camera{local.R_C_B * R_B_W, {}};
  camera.t_C = -(camera.R_C_W * p_W) - local.R_C_B * local.p_B_C;
  return camera;
}

/// A spot's residual [sigmas] and its derivatives. Many boards are seen by a camera at one instant,
/// so its derivatives are those of `CameraAt`, and the board's and the lens's come on top.
struct SpotRow {
  Eigen::Vector2d r;
  Eigen::Matrix<double, 2, local_columns::kSize> J;
  Eigen::Matrix<double, 2, 3> J_board;
};

/// Of a board that was seen at the pixel `seen`. Empty where the lens has no projection.
[[nodiscard]] std::optional<SpotRow> spot_residual(const LocalState<LocalJet>& local,
                                                   const CameraAt<LocalJet>& camera,
                                                   const Eigen::Vector3d& board_W,
                                                   const Eigen::Vector2d& seen, double sigma_px);
/// The same without derivatives.
[[nodiscard]] std::optional<Eigen::Vector2d> spot_residual(const LocalState<double>& local,
                                                           const CameraAt<double>& camera,
                                                           const Eigen::Vector3d& board_W,
                                                           const Eigen::Vector2d& seen,
                                                           double sigma_px);

}  // namespace crepes
