/// A lens of either model as a vector of numbers, for a fit.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "estimator/core/camera_calibration.hpp"

namespace crepes {

/// The models that are fitted.
enum class LensKind : std::uint8_t { kDoubleSphere, kKannalaBrandt };

/// Double Sphere: xi, alpha, fx, fy, cx, cy. Kannala-Brandt: fx, fy, cx, cy, k1, k2, k3, k4.
struct GridLens {
  LensKind kind = LensKind::kDoubleSphere;
  Eigen::VectorXd numbers;

  [[nodiscard]] Eigen::Vector2d center() const;
  /// The pixel of a point, camera axes; empty where the lens has no projection.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p_C) const;
  /// The unit direction that `uv` sees, camera axes; empty outside the image circle.
  [[nodiscard]] std::optional<Eigen::Vector3d> direction(const Eigen::Vector2d& uv) const;
  /// In the words of a configuration. The mounting stays unknown.
  [[nodiscard]] CameraCalibration calibration(const std::array<int, 2>& resolution) const;
  /// Whether the numbers are in the model's domain.
  [[nodiscard]] bool is_valid() const;
};

/// A centered fisheye whose focal length is `scale` times that of a lens which shows `fov_rad` in
/// the circle that touches the nearer border.
[[nodiscard]] GridLens generic_grid_lens(LensKind kind, const std::array<int, 2>& resolution,
                                         double fov_rad, double scale);

}  // namespace crepes
