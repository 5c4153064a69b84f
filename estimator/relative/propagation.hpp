/// Propagation of the relative motion by both IMUs, with its covariance.
#pragma once

#include <Eigen/Core>

#include "estimator/core/imu_history.hpp"
#include "estimator/relative/error_state.hpp"

namespace crepes {

/// One robot's rates over a step, corrected by the errors of its IMU.
struct BodyRates {
  Eigen::Vector3d w = Eigen::Vector3d::Zero();  ///< [rad/s], body axes
  Eigen::Vector3d a = Eigen::Vector3d::Zero();  ///< specific force [m/s^2], body axes
};

/// Noise of the IMUs and of the range bias, the same for all robots. Densities are white noise per
/// sqrt(Hz). Where no sample covers, the rates are random walks: the extrapolation densities are
/// their least densities; the innovation densities of the signals are added.
struct ProcessNoise {
  static constexpr double kGyroExtrapolationDensity = 0.3;   ///< [rad/s/sqrt(s)]
  static constexpr double kAccelExtrapolationDensity = 3.0;  ///< [m/s^2/sqrt(s)]

  double gyro_density = 0.0;
  double accel_density = 0.0;
  double gyro_walk = 0.0;
  double accel_walk = 0.0;
  double range_bias_walk = 0.0;    ///< [m/sqrt(s)]
  double range_bias_return = 0.0;  ///< rate of its decay to zero [1/s]
};

/// The step of paper eq. 9 with the forces turned to the middle of the step:
///   a  = R Exp(w_N dt/2) a_N - Exp(w_B dt/2) a_B
///   p <- Exp(w_B dt)^T (p + v dt + a dt^2/2)
///   v <- Exp(w_B dt)^T (v + a dt)
///   R <- Exp(w_B dt)^T R Exp(w_N dt)
[[nodiscard]] RelativeMotion propagated(const RelativeMotion& motion, const BodyRates& body,
                                        const BodyRates& neighbor, double dt);

/// Jacobian of `propagated`: of its error [p, v, theta] by the error before and by the rates.
struct PropagationJacobian {
  Eigen::Matrix<double, 9, 9> by_motion;
  Eigen::Matrix<double, 9, 12> by_rates;  ///< columns w_B, a_B, w_N, a_N
};
/// The derivative of the motion after a step by the motion before it and by the rates.
[[nodiscard]] PropagationJacobian propagation_jacobian(const RelativeMotion& before,
                                                       const RelativeMotion& after,
                                                       const BodyRates& body,
                                                       const BodyRates& neighbor, double dt);

/// Variance of the rates [w_B, a_B, w_N, a_N] over a step, as white noise.
[[nodiscard]] Eigen::Matrix<double, 12, 1> rate_variance(const ImuMean& body,
                                                         const ImuMean& neighbor,
                                                         const ProcessNoise& noise, double dt);

/// Propagates state and covariance from `from` to `to` in steps of at most 10 ms.
void propagate(const ImuHistory& imu_B, const ImuHistory& imu_N, Timestamp from, Timestamp to,
               const ProcessNoise& noise, NominalState& state, ErrorState::Covariance& P);

/// Propagates a motion without covariance, forward or back, for example another robot's estimate.
[[nodiscard]] RelativeMotion propagated_by_imus(const RelativeMotion& motion,
                                                const ImuHistory& imu_B, const ImuHistory& imu_N,
                                                Timestamp from, Timestamp to);

/// What an error [p, theta] of T_B_N at one instant is in the axes that both bodies have at
/// another, by their gyroscopes. There must be samples.
[[nodiscard]] Matrix6d error_rotation(const ImuHistory& imu_B, const ImuHistory& imu_N,
                                      Timestamp from, Timestamp to);

}  // namespace crepes
