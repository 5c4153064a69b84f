/// The state of one neighbor's filter and the layout of its error.
#pragma once

#include <Eigen/Core>

#include "estimator/core/pose.hpp"
#include "estimator/core/time.hpp"
#include "estimator/relative/partitioned_covariance.hpp"

namespace crepes {

/// Motion of N relative to B. It does not depend on gravity, which acts on both robots alike.
struct RelativeMotion {
  Pose T_B_N;
  Eigen::Vector3d v_B_N = Eigen::Vector3d::Zero();  ///< R_W_B^T (v_W_N - v_W_B) [m/s]
};

/// Errors of an IMU: each sensor reads (I + scale) x + bias, where `scale` contains scale errors
/// and misalignments of its axes.
struct ImuBias {
  Eigen::Vector3d gyro_radps = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_mps2 = Eigen::Vector3d::Zero();
  Eigen::Matrix3d gyro_scale = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d accel_scale = Eigen::Matrix3d::Zero();
};

/// What a sensor of an IMU measured, without its errors: it reads (I + scale) x + bias. First order
/// in `scale`. All are in the sensor's unit, body axes.
[[nodiscard]] inline Eigen::Vector3d without_errors(const Eigen::Vector3d& measured,
                                                    const Eigen::Vector3d& bias,
                                                    const Eigen::Matrix3d& scale) {
  const Eigen::Vector3d unbiased = measured - bias;
  return unbiased - scale * unbiased;
}

/// Everything that the tight filter estimates.
struct NominalState {
  RelativeMotion motion;
  ImuBias bias_B;
  ImuBias bias_N;
  double range_bias_m = 0.0;
  /// Rotation vectors from a direction in calibrated body axes to the one that the camera reports.
  Eigen::Vector3d misalignment_B = Eigen::Vector3d::Zero();
  Eigen::Vector3d misalignment_N = Eigen::Vector3d::Zero();
};

/// Layout of the error state. Position and velocity are additive in B's axes, attitude is a right
/// perturbation (N's axes), all others are additive. Measurements depend on the first `kSeen`
/// states; the others act through the propagation.
struct ErrorState {
  /// The first row of each part of the error.
  enum Index : int {
    kP = 0,
    kV = 3,
    kTheta = 6,
    kRangeBias = 9,
    kMisalignB = 10,
    kMisalignN = 13,
    kGyroB = 16,
    kAccelB = 19,
    kGyroN = 22,
    kAccelN = 25,
    kGyroScaleB = 28,  ///< by columns, as the following
    kAccelScaleB = 37,
    kGyroScaleN = 46,
    kAccelScaleN = 55,
    kSize = 64,
  };
  static constexpr int kMotion = kRangeBias;  ///< size of [p, v, theta]
  static constexpr int kSeen = kGyroB;
  using Vector = Eigen::Matrix<double, kSize, 1>;
  using Covariance = PartitionedCovariance<kSeen, kSize>;
};

/// x <- x (+) dx, with the motion corrected in polar coordinates (polar_error.hpp).
void inject(const ErrorState::Vector& dx, NominalState& state);

}  // namespace crepes
