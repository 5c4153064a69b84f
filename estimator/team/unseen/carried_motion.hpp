/// A robot's motion by its IMU over many intervals, and how it depends on where it began.
#pragma once

#include <Eigen/Core>

#include "estimator/team/belief/robot_trajectory.hpp"

namespace crepes {

/// Of an IMU: its biases, and its gyroscope's scale errors.
using ImuErrors = Eigen::Matrix<double, FreeMotionAt::kBias, 1>;

/// A motion with its derivative by the IMU's errors.
struct CarriedMotion {
  static constexpr int kMotion = FreeMotionAt::kMotion;
  static constexpr int kErrors = FreeMotionAt::kBias;
  static constexpr int kStart = kMotion + kErrors;  ///< the first motion, and the IMU's errors

  double t_s = 0.0;
  FreeMotion motion{};
  Eigen::Matrix<double, kMotion, kErrors> by_errors =
      Eigen::Matrix<double, kMotion, kErrors>::Zero();
  MotionMatrix noise = MotionMatrix::Zero();  ///< that the IMU has added

  /// At a point of a trajectory that begins here.
  [[nodiscard]] CarriedMotion followed_by(const FreeMotionAt& piece) const;
  /// The same from another start than rest at the origin, and with errors of the IMU
  /// (preintegration: Forster et al. 2017, with its bias correction).
  [[nodiscard]] CarriedMotion started_at(const FreeMotion& start, const ImuErrors& errors) const;
};

}  // namespace crepes
