/// Finds the times at which an inertial sensor lay still.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "estimator/core/measurements.hpp"

namespace crepes {

/// Samples first to last (not included) without motion, and their means as read.
struct Rest {
  std::size_t first = 0;
  std::size_t last = 0;
  double begin_s = 0.0;  ///< after the first sample of the recording
  double end_s = 0.0;
  Eigen::Vector3d gyro_radps = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_mps2 = Eigen::Vector3d::Zero();

  [[nodiscard]] double duration_s() const { return end_s - begin_s; }
};

/// The rests of a recording, and the noise in them.
struct RestSearch {
  std::vector<Rest> rests;
  double gyro_sigma_radps = 0.0;  ///< of one sample and axis at rest
  double accel_sigma_mps2 = 0.0;
  int shaky = 0;             ///< pauses in which the sensor was held but did not lie still
  double shake_radps = 0.0;  ///< median over these pauses: what the gyroscope reads too much
};

/// As in Tedaldi, Pretto, Menegatti (ICRA 2014), section IV-A: a window of half a second is at rest
/// while the variances of both sensors are near those of the quietest part of the recording.
[[nodiscard]] RestSearch find_rests(std::span<const ImuSample> samples);

}  // namespace crepes
