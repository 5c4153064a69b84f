/// Config keys as the filters want them.
#pragma once

#include "estimator/core/config.hpp"
#include "estimator/relative/neighbor_filter.hpp"
#include "estimator/relative/propagation.hpp"

namespace crepes {

/// Gates on the normalized innovation squared, by dimension of the measurement.
struct Gates {
  double range = 0.0;
  double bearing = 0.0;
  double pose = 0.0;
  double raw_pose = 0.0;
};

struct FilterSettings {
  Profile profile = Profile::kTight;
  Duration lag{};
  Duration recent{};  ///< a measurement within this makes a pose direct
  Duration forget{};  ///< a neighbor silent for longer is forgotten
  ProcessNoise noise;
  Priors priors;
  Gates gates;
  double range_sigma_m = 0.0;
  double max_range_m = 0.0;
  double late_path_db = 0.0;
};

[[nodiscard]] FilterSettings filter_settings(const EstimatorConfig& estimator, const ImuConfig& imu,
                                             const UwbConfig& uwb);

}  // namespace crepes
