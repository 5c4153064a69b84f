/// What an IMU's noise does to a body between two knots.
#pragma once

#include "estimator/calibration/batch/arrow_system.hpp"
#include "estimator/core/sensor_noise.hpp"

namespace crepes {

/// The inverse square root of the covariance after `dt` seconds: L with  L^T L = P^-1 . Order
/// [theta, v, p, gyro bias, accel bias].
[[nodiscard]] ArrowSystem::StateMatrix knot_whitening(const ImuNoise& noise, double dt);

}  // namespace crepes
