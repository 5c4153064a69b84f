/// A gyroscope's bias between rests, as a random walk that each rest measures.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "estimator/calibration/imu/rests.hpp"

namespace crepes {

/// The Kalman smoother (Rauch, Tung, Striebel 1965) of a bias at the middle of each rest.
class WanderingBias {
 public:
  /// There must be a rest. `density`: white noise [rad/s/sqrt(Hz)]; `random_walk`
  /// [rad/s^2/sqrt(Hz)].
  WanderingBias(const std::vector<Rest>& rests, double density, double random_walk);

  /// Half way between the middles of rest `k` and the next.
  [[nodiscard]] Eigen::Vector3d between(std::size_t k) const;
  /// Over the time from the first rest's beginning to the last one's end.
  [[nodiscard]] const Eigen::Vector3d& mean() const { return mean_; }
  [[nodiscard]] double mean_sigma() const { return mean_sigma_; }

 private:
  std::vector<Eigen::Vector3d> at_rest_;
  Eigen::Vector3d mean_ = Eigen::Vector3d::Zero();
  double mean_sigma_ = 0.0;
};

}  // namespace crepes
