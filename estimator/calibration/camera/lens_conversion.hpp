/// A Double Sphere lens in the terms of Kannala and Brandt, which more programs read.
#pragma once

#include <Eigen/Core>
#include <array>

#include "estimator/calibration/camera/camera_state.hpp"

namespace crepes {

/// The coefficients, and how well they fit.
struct KannalaBrandtFit {
  Eigen::Vector4d pinhole = Eigen::Vector4d::Zero();  ///< fu, fv, pu, pv
  std::array<double, 4> k{};                          ///< k1 to k4
  double rms_px = 0.0;                                ///< by which the two differ over the picture
  double max_px = 0.0;
};

/// Linear least squares over the angles that a picture of this size sees, each weighted by its
/// share of the picture: the radius  g(t) = s (t + k1 t^3 + k2 t^5 + k3 t^7 + k4 t^9).  Focal
/// lengths are those of `lens` times s; the center is the same.
[[nodiscard]] KannalaBrandtFit to_kannala_brandt(const LensVector& lens, int width, int height);

}  // namespace crepes
