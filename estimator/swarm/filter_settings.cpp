#include "estimator/swarm/filter_settings.hpp"

#include <cmath>

#include "estimator/core/constants.hpp"
#include "estimator/relative/chi_square.hpp"

namespace crepes {
namespace {

constexpr double kBiasTime = 2.0;  // s
// The tight filter fuses the bearings of its raw pose once more, one by one. This sigma keeps the
// raw pose from counting them first.
constexpr double kLooseBearing = 0.05;  // rad

constexpr ProfileTraits kPaperTraits{.has_bias_states = false,
                                     .fuses_single_readings = false,
                                     .hypotheses_compete = false,
                                     .starts_one_way = false,
                                     .has_team_filter = false};

}  // namespace

FilterSettings filter_settings(const EstimatorSettings& settings) {
  const EstimatorConfig& estimator = settings.filters;
  const ImuNoise& imu = settings.imu;
  const RangeNoise& range = settings.range;
  FilterSettings s;
  if (estimator.profile == Profile::kPaper) s.traits = kPaperTraits;
  s.lag = from_seconds(estimator.lag_ms * 1e-3);
  s.recent = from_seconds(estimator.predicted_after_s);

  s.noise.gyro_density = imu.gyroscope_noise_density;
  s.noise.accel_density = imu.accelerometer_noise_density;
  s.noise.gyro_walk = imu.gyroscope_random_walk;
  s.noise.accel_walk = imu.accelerometer_random_walk;
  // A Gauss-Markov process: a random walk that reaches bias_drift_m within bias_time_s, with a
  // stationary sigma of bias_sigma_m.
  s.noise.range_bias_walk = range.bias_drift_m / std::sqrt(range.bias_time_s);
  if (range.bias_sigma_m > 0.0)
    s.noise.range_bias_return = 0.5 * std::pow(s.noise.range_bias_walk / range.bias_sigma_m, 2);

  if (!s.traits.has_bias_states) {
    // Noise replaces the effect of a bias over kBiasTime.
    s.noise.accel_density =
        std::hypot(s.noise.accel_density, imu.accelerometer_bias_sigma * std::sqrt(kBiasTime));
    s.noise.gyro_density =
        std::hypot(s.noise.gyro_density, imu.gyroscope_bias_sigma * std::sqrt(kBiasTime));
  }

  s.priors.gyro_bias_radps = imu.gyroscope_bias_sigma;
  s.priors.accel_bias_mps2 = imu.accelerometer_bias_sigma;
  s.priors.gyro_scale = imu.gyroscope_scale_sigma;
  s.priors.accel_scale = imu.accelerometer_scale_sigma;
  s.priors.range_bias_m = range.bias_sigma_m;
  s.priors.misalignment_rad = radians(estimator.camera_misalignment_deg);
  s.priors.lens_rad = 1e-3 * estimator.camera_lens_mrad;

  const double p = estimator.gate_probability;
  s.gates = {.range = chi_square_quantile(p, 1),
             .bearing = chi_square_quantile(p, 2),
             .pose = chi_square_quantile(p, 6),
             .raw_pose = chi_square_quantile(p, 9)};
  s.range_sigma_m = range.noise_m;
  s.raw_pose_range_sigma_m = std::hypot(s.range_sigma_m, s.priors.range_bias_m);
  s.raw_pose_calibration_sigma_rad =
      s.traits.fuses_single_readings ? kLooseBearing : s.priors.misalignment_rad;
  s.max_range_m = range.max_range_m;
  s.late_path_db = range.late_path_db;
  return s;
}

}  // namespace crepes
