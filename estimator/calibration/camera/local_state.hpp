/// A knot and the constants of a camera calibration, for numbers that carry derivatives.
#pragma once

#include <Eigen/Core>

#include "estimator/calibration/batch/arrow_system.hpp"
#include "estimator/calibration/batch/jet_geometry.hpp"
#include "estimator/calibration/camera/camera_state.hpp"

namespace crepes {

/// The parameters' indices: the knot in its error order, then the constants without boards, in the
/// order of `camera_constants`.
namespace local_columns {
inline constexpr int kConstants = ArrowSystem::kState;
inline constexpr int kSize = kConstants + camera_constants::kBoards;
}  // namespace local_columns

/// What the residuals of an interval depend on, each number a parameter: the motion at its knot,
/// which is then carried along the interval, and the constants. Units and frames as in
/// `CameraState`.
template <class T>
struct LocalState {
  Motion<T> motion;
  Vector3<T> gyro_bias;
  Vector3<T> accel_bias;
  Eigen::Matrix<T, 6, 1> lens;
  Matrix3<T> R_C_B;
  Vector3<T> p_B_C;
  T shift;
  Matrix3<T> M_gyro;
  Matrix3<T> M_accel;

  LocalState(const CameraConstants& constants, const CameraKnot& knot) {
    namespace at = camera_constants;
    constexpr int kFirst = local_columns::kConstants;
    motion = {seeded_rotation<T>(knot.q_W_B, 0), seeded<T>(knot.v_W, 3), seeded<T>(knot.p_W, 6)};
    gyro_bias = seeded<T>(knot.gyro_bias, 9);
    accel_bias = seeded<T>(knot.accel_bias, 12);
    for (int i = 0; i < 6; ++i) lens[i] = seeded<T>(constants.lens[i], kFirst + at::kLens + i);
    R_C_B = seeded_rotation<T>(constants.q_C_B, kFirst + at::kRotation);
    p_B_C = seeded<T>(constants.p_B_C, kFirst + at::kPosition);
    shift = seeded<T>(constants.shift_s, kFirst + at::kShift);
    int next = kFirst + at::kGyroMatrix;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) M_gyro(i, j) = seeded<T>(constants.M_gyro(i, j), next++);
    M_accel.setConstant(T(0.0));
    for (int i = 0; i < 3; ++i)
      for (int j = i; j < 3; ++j) M_accel(i, j) = seeded<T>(constants.M_accel(i, j), next++);
  }
};

}  // namespace crepes
