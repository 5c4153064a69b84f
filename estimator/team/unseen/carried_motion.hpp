/// A robot's motion by its IMU over many intervals, and how it depends on where it began.
#pragma once

#include <Eigen/Core>

#include "estimator/team/belief/robot_trajectory.hpp"

namespace crepes {

/// Of an IMU: its biases, and its gyroscope's scale errors.
using ImuErrors = Eigen::Matrix<double, FreeMotionAt::kBias, 1>;

/// A motion with its derivative by the motion at the first beginning and by the IMU's errors.
struct CarriedMotion {
  static constexpr int kMotion = FreeMotionAt::kMotion;
  static constexpr int kStart = FreeMotionAt::kStart;
  static constexpr int kErrors = FreeMotionAt::kBias;
  using Covariance = Eigen::Matrix<double, kMotion, kMotion>;

  double t_s = 0.0;
  FreeMotion motion{};
  Eigen::Matrix<double, kMotion, kStart> by_start =
      Eigen::Matrix<double, kMotion, kStart>::Identity();
  Covariance noise = Covariance::Zero();  ///< that the IMU has added

  /// At a point of a trajectory that begins here.
  [[nodiscard]] CarriedMotion followed_by(const FreeMotionAt& piece) const;
  /// The same from another start than rest at the origin, and with errors of the IMU
  /// (preintegration: Forster et al. 2017, with its bias correction).
  [[nodiscard]] CarriedMotion started_at(const FreeMotion& start, const ImuErrors& errors) const;
};

}  // namespace crepes
