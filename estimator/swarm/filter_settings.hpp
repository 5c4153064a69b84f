/// The configuration, in the form that the filters use.
#pragma once

#include "estimator/relative/neighbor_filter.hpp"
#include "estimator/relative/propagation.hpp"
#include "estimator/swarm/estimator_settings.hpp"

namespace crepes {

/// Gates on the normalized innovation squared, by dimension of the measurement.
struct Gates {
  double range = 0.0;
  double bearing = 0.0;
  double pose = 0.0;
  double raw_pose = 0.0;
};

/// The consequences of the profile: the only place where it is decided.
struct ProfileTraits {
  bool has_bias_states = true;        ///< `NeighborFilter`; otherwise `PaperFilter`
  bool fuses_single_readings = true;  ///< bearings and ranges; otherwise raw poses
  bool hypotheses_compete = true;     ///< otherwise each raw pose replaces the filter
  bool starts_one_way = true;         ///< a track may start from bearings of one direction
  bool has_team_filter = true;        ///< otherwise the pose graph estimates the team

  [[nodiscard]] bool operator==(const ProfileTraits&) const = default;
};

struct FilterSettings {
  ProfileTraits traits;
  Duration lag{};
  Duration recent{};  ///< a measurement within this makes a pose direct
  ProcessNoise noise;
  Priors priors;
  Gates gates;
  double range_sigma_m = 0.0;
  double raw_pose_range_sigma_m = 0.0;          ///< of one range, with its bias
  double raw_pose_calibration_sigma_rad = 0.0;  ///< added to a bearing's noise in raw poses
  double max_range_m = 0.0;
  double late_path_db = 0.0;
};

/// Derives the settings of the filters, of `filters`, `imu` and `range`.
[[nodiscard]] FilterSettings filter_settings(const EstimatorSettings& settings);

}  // namespace crepes
