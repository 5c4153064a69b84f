/// Settings: errors of inertial sensors and ranges.
#pragma once

#include "estimator/core/settings_schema.hpp"

namespace crepes {

/// Noise under Kalibr's names (imu.yaml), and one-sigma priors of what calibration left.
struct ImuNoise {
  double update_rate = 100.0;
  double accelerometer_noise_density = 0.0018;
  double gyroscope_noise_density = 0.00037;
  double accelerometer_random_walk = 0.0002;
  double gyroscope_random_walk = 0.0001;
  double accelerometer_bias_sigma = 0.035;
  double gyroscope_bias_sigma = 0.005;
  double accelerometer_scale_sigma = 0.002;
  double gyroscope_scale_sigma = 0.003;

  [[nodiscard]] bool operator==(const ImuNoise&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.reference("calibration",
                "Kalibr's imu.yaml or Basalt's calibration.json, for update_rate to "
                "gyroscope_random_walk; keys in this section override it");
    v.field("update_rate", update_rate, Bounds{25, 1000}, "samples per second");
    v.field("accelerometer_noise_density", accelerometer_noise_density, Bounds{1e-5, 1},
            "white noise [m/s^2/sqrt(Hz)]");
    v.field("gyroscope_noise_density", gyroscope_noise_density, Bounds{1e-6, 1},
            "white noise [rad/s/sqrt(Hz)]");
    v.field("accelerometer_random_walk", accelerometer_random_walk, Bounds{0, 1},
            "bias random walk [m/s^3/sqrt(Hz)]");
    v.field("gyroscope_random_walk", gyroscope_random_walk, Bounds{0, 1},
            "bias random walk [rad/s^2/sqrt(Hz)]");
    v.field("accelerometer_bias_sigma", accelerometer_bias_sigma, Bounds{0, 5},
            "prior of the bias at power-on, one sigma [m/s^2]");
    v.field("gyroscope_bias_sigma", gyroscope_bias_sigma, Bounds{0, 1},
            "prior of the bias at power-on, one sigma [rad/s]");
    v.field("accelerometer_scale_sigma", accelerometer_scale_sigma, Bounds{0, 0.1},
            "each scale and axis error that remains after calibration, one sigma");
    v.field("gyroscope_scale_sigma", gyroscope_scale_sigma, Bounds{0, 0.1},
            "each scale and axis error that remains after calibration, one sigma");
  }
};

/// Errors of ranges, and which ones are refused.
struct RangeNoise {
  double noise_m = 0.05;
  double bias_sigma_m = 0.05;
  double bias_drift_m = 0.01;
  double bias_time_s = 10.0;
  double max_range_m = 200.0;
  double late_path_db = 8.0;

  [[nodiscard]] bool operator==(const RangeNoise&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("noise_m", noise_m, Bounds{0.001, 2}, "one sigma of a single range");
    v.field("bias_sigma_m", bias_sigma_m, Bounds{0, 2}, "constant bias of a pair, one sigma");
    v.field("bias_drift_m", bias_drift_m, Bounds{0, 2},
            "change of the bias within bias_time_s, as antennas turn");
    v.field("bias_time_s", bias_time_s, Bounds{0.1, 1000}, "see bias_drift_m [s]");
    v.field("max_range_m", max_range_m, Bounds{1, 1000}, "longer ranges are refused");
    v.field("late_path_db", late_path_db, Bounds{1, 40},
            "if the received power exceeds the first path's by more than this, there is no line of "
            "sight and the range is too long");
  }
};

}  // namespace crepes
