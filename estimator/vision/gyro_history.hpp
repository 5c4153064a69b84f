/// The last gyro samples: how the body turned between two frames.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "estimator/core/measurements.hpp"

namespace crepes {

/// Keeps the last half second or so; linear between samples, constant beyond the ends.
class GyroHistory {
 public:
  /// False when `sample` was refused: not finite, or not later than the one before.
  [[nodiscard]] bool add(const ImuSample& sample);

  /// R_B0_B1: the attitude of the body at `to` in the body at `from`; identity without samples.
  [[nodiscard]] Eigen::Quaterniond rotation(Timestamp from, Timestamp to) const;

 private:
  struct Sample {
    Timestamp stamp{};
    Eigen::Vector3d gyro_radps = Eigen::Vector3d::Zero();
  };

  [[nodiscard]] Eigen::Vector3d rate_at(Timestamp stamp) const;

  std::vector<Sample> samples_;
};

}  // namespace crepes
