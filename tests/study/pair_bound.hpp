/// How well anyone could know one robot from another: the posterior Cramer-Rao bound of a pair.
#pragma once

#include "tests/study/pair_sightings.hpp"

namespace crepes::study {

/// How far sensors are off before anything is measured; one sigma, vectors an axis. The defaults
/// are those of the shared recordings and of the simulated swarms, without scale errors, as bounds
/// are published.
struct SensorPriors {
  double gyro_bias_radps = 0.3 * 0.017453292519943295;
  double accel_bias_mps2 = 0.0325;
  double misalignment_rad = 0.15 * 0.017453292519943295;
  double range_bias_m = 0.045;
  double gyro_scale = 0.0;     ///< of each entry of a sensor's scales and axes
  double accel_scale = 0.0;    ///< of each entry
  double gyro_walk = 8.7e-5;   ///< [rad/s^2/sqrt(Hz)]
  double accel_walk = 0.0002;  ///< [m/s^3/sqrt(Hz)]
};

/// With the scale and axis errors of simulated swarms; recordings show 0.0026 and 0.0017.
inline constexpr SensorPriors kScaledPriors{.gyro_scale = 0.003, .accel_scale = 0.002};

/// Of the square roots of the traces of both 3x3 blocks of T_B_N's covariance, over time.
struct PairBound {
  double position_rms_m = 0.0;
  double position_median_m = 0.0;
  double rotation_rms_rad = 0.0;
  double rotation_median_rad = 0.0;
};

/// The posterior Cramer-Rao bound of T_B_N (Tichavsky, Muravchik, Nehorai 1998), which for Gaussian
/// noise and small errors is the Kalman filter's covariance, linearized at the truth. Causal.
/// States: p, v and R of `neighbor` in `observer`'s body frame, gyro and accelerometer biases of
/// both, their scale and axis errors, a constant range bias, both cameras' misalignment.
/// Measurements: both cameras' sightings and both modules' ranges, when they were recorded and as
/// noisy as the recording shows; both IMUs drive the process with the noise that they show.
/// Statistics from `after_s` on, 50 Hz.
[[nodiscard]] PairBound pair_bound(const Swarm& swarm, RobotId observer, RobotId neighbor,
                                   const SensorPriors& priors, double after_s);

}  // namespace crepes::study
