/// Wide-angle cameras: pixels to directions and back.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "estimator/core/config.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// The Double Sphere model of one camera (Usenko, Demmel, Cremers 2018, "The Double Sphere Camera
/// Model", section III-D). Pixel centers have integer coordinates.
class CameraModel {
 public:
  using ProjectionJacobian = Eigen::Matrix<double, 2, 3>;    ///< d uv / d p_C [px/m]
  using UnprojectionJacobian = Eigen::Matrix<double, 3, 2>;  ///< d u_C / d uv [1/px]

  /// Refuses intrinsics of the wrong number, not finite or outside the model's domain.
  [[nodiscard]] static Result<CameraModel> from(const CameraConfig& config);

  /// The pixel that sees `p_C`, which may lie beyond the image's border. Empty where the model has
  /// no unique projection: behind the camera and at its center.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p_C,
                                                       ProjectionJacobian* J = nullptr) const;

  /// The unit direction that `uv` sees, camera axes. Empty outside the image circle.
  [[nodiscard]] std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& uv,
                                                         UnprojectionJacobian* J = nullptr) const;

  /// Whether `uv` lies on the sensor.
  [[nodiscard]] bool contains(const Eigen::Vector2d& uv) const;

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }

 private:
  CameraModel() = default;

  double xi_ = 0.0;
  double alpha_ = 0.0;
  Eigen::Vector2d focal_ = Eigen::Vector2d::Ones();
  Eigen::Vector2d center_ = Eigen::Vector2d::Zero();
  double min_cos_ = 0.0;      ///< -w2 of eq. 43: least z / |p_C| that projects
  double max_radius2_ = 0.0;  ///< eq. 51: greatest r^2 that unprojects
  int width_ = 0;
  int height_ = 0;
};

}  // namespace crepes
