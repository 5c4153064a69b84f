/// A spot of one frame as a direction.
#pragma once

#include <Eigen/Core>

#include "estimator/core/time.hpp"

namespace crepes {

/// A spot as a direction in the body frame as it is at the stamp of the frame.
struct LightSighting {
  Eigen::Vector3d u_B = Eigen::Vector3d::UnitX();
  double radius_rad = 0.0;  ///< of the blob
  double px_rad = 0.0;      ///< what a pixel subtends here
  double peak = 0.0;        ///< gray levels
  int ring_leds = 0;        ///< of its ring; 0: they were not told apart
  double ring_tan = 0.0;    ///< radius over distance of the ring
  double ring_sigma = 0.0;  ///< of `ring_tan`, relative
  Timestamp exposed{};      ///< middle of its row's exposure, body time
};

/// The squared chord of two directions, which is the squared angle if they are near [rad^2].
[[nodiscard]] inline double squared_chord(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return (a - b).squaredNorm();
}

}  // namespace crepes
