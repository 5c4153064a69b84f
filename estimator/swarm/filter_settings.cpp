#include "estimator/swarm/filter_settings.hpp"

#include <cmath>
#include <numbers>

#include "estimator/relative/chi_square.hpp"

namespace crepes {
namespace {

constexpr double kBiasTime = 2.0;  // s

}  // namespace

FilterSettings filter_settings(const EstimatorConfig& estimator, const ImuConfig& imu,
                               const UwbConfig& uwb) {
  FilterSettings s;
  s.profile = estimator.profile;
  s.lag = from_seconds(estimator.lag_ms * 1e-3);
  s.recent = from_seconds(estimator.predicted_after_s);
  s.forget = from_seconds(estimator.forget_after_s);

  s.noise.gyro_density = imu.gyroscope_noise_density;
  s.noise.accel_density = imu.accelerometer_noise_density;
  s.noise.gyro_walk = imu.gyroscope_random_walk;
  s.noise.accel_walk = imu.accelerometer_random_walk;
  // A random walk that reaches bias_drift_m within bias_time_s, drawn back so that in the long run
  // it stays within bias_sigma_m (a Gauss-Markov process).
  s.noise.range_bias_walk = uwb.bias_drift_m / std::sqrt(uwb.bias_time_s);
  if (uwb.bias_sigma_m > 0.0)
    s.noise.range_bias_return = 0.5 * std::pow(s.noise.range_bias_walk / uwb.bias_sigma_m, 2);

  if (s.profile == Profile::kPaper) {
    // The paper's filter has no bias states: what a bias does within kBiasTime must pass as noise.
    s.noise.accel_density =
        std::hypot(s.noise.accel_density, imu.accelerometer_bias_sigma * std::sqrt(kBiasTime));
    s.noise.gyro_density =
        std::hypot(s.noise.gyro_density, imu.gyroscope_bias_sigma * std::sqrt(kBiasTime));
  }

  s.priors.gyro_bias_radps = imu.gyroscope_bias_sigma;
  s.priors.accel_bias_mps2 = imu.accelerometer_bias_sigma;
  s.priors.gyro_scale = imu.gyroscope_scale_sigma;
  s.priors.accel_scale = imu.accelerometer_scale_sigma;
  s.priors.range_bias_m = uwb.bias_sigma_m;
  s.priors.misalignment_rad = estimator.camera_misalignment_deg * std::numbers::pi / 180.0;

  const double p = estimator.gate_probability;
  s.gates = {.range = chi_square_quantile(p, 1),
             .bearing = chi_square_quantile(p, 2),
             .pose = chi_square_quantile(p, 6),
             .raw_pose = chi_square_quantile(p, 9)};
  s.range_sigma_m = uwb.noise_m;
  s.max_range_m = uwb.max_range_m;
  s.late_path_db = uwb.late_path_db;
  return s;
}

}  // namespace crepes
