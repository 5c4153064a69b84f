/// Relative motion between two accelerating, turning robots, and how its error moves.
#pragma once

#include <Eigen/Core>

#include "estimator/relative/error_state.hpp"
#include "estimator/relative/imu_history.hpp"

namespace crepes {

/// One robot's rates over a step, without what its IMU adds.
struct BodyRates {
  Eigen::Vector3d w = Eigen::Vector3d::Zero();  ///< [rad/s], body axes
  Eigen::Vector3d a = Eigen::Vector3d::Zero();  ///< specific force [m/s^2], body axes
};

/// How far to trust the IMUs, the same for all robots of a team. Densities are white noise per
/// sqrt(Hz); `guess` changes are what may begin at any time where no sample covers, beside what the
/// signal's own surprises tell.
struct ProcessNoise {
  double gyro_density = 0.0;
  double accel_density = 0.0;
  double gyro_walk = 0.0;
  double accel_walk = 0.0;
  double gyro_guess_change = 0.3;   ///< [rad/s/sqrt(s)]
  double accel_guess_change = 3.0;  ///< [m/s^2/sqrt(s)]
  double range_bias_walk = 0.0;     ///< [m/sqrt(s)]
  double range_bias_return = 0.0;   ///< to zero, so that a walk stays within bounds [1/s]
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
[[nodiscard]] PropagationJacobian propagation_jacobian(const RelativeMotion& before,
                                                       const RelativeMotion& after,
                                                       const BodyRates& body,
                                                       const BodyRates& neighbor, double dt);

/// Variance of the rates [w_B, a_B, w_N, a_N] over a step, as if they were white.
[[nodiscard]] Eigen::Matrix<double, 12, 1> rate_variance(const ImuMean& body,
                                                         const ImuMean& neighbor,
                                                         const ProcessNoise& noise, double dt);

/// Moves state and covariance from `from` to `to` in steps of at most 10 ms.
void propagate(const ImuHistory& imu_B, const ImuHistory& imu_N, Timestamp from, Timestamp to,
               const ProcessNoise& noise, NominalState& state, ErrorState::Covariance& P);

/// Moves a bare relative motion, forward or back, for example another robot's estimate.
[[nodiscard]] RelativeMotion moved(const RelativeMotion& motion, const ImuHistory& imu_B,
                                   const ImuHistory& imu_N, Timestamp from, Timestamp to);

}  // namespace crepes
