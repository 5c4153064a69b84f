/// Wide-angle cameras: pixels to directions and back.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "estimator/core/camera_calibration.hpp"
#include "estimator/core/result.hpp"
#include "estimator/vision/double_sphere.hpp"
#include "estimator/vision/kannala_brandt.hpp"

namespace crepes {

/// What is wrong with a camera's calibration: one of its keys, and why.
struct CalibrationFault {
  std::string_view key;
  std::string reason;
};
[[nodiscard]] std::vector<CalibrationFault> calibration_faults(const CameraCalibration& config);

/// One camera: a lens, focal lengths and a sensor. Pixel centers have integer coordinates.
class CameraModel {
 public:
  using ProjectionJacobian = Eigen::Matrix<double, 2, 3>;    ///< d uv / d p_C [px/m]
  using UnprojectionJacobian = Eigen::Matrix<double, 3, 2>;  ///< d u_C / d uv [1/px]

  /// Refuses a calibration that has faults.
  [[nodiscard]] static Result<CameraModel> from(const CameraCalibration& config);

  /// The pixel that sees `p_C`, which may lie beyond the image's border. Empty where the lens has
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
  using Lens = std::variant<DoubleSphere, KannalaBrandt>;

  CameraModel(const Lens& lens, const Eigen::Vector4d& pinhole, std::array<int, 2> resolution);

  Lens lens_;
  Eigen::Vector2d focal_;
  Eigen::Vector2d center_;
  int width_;
  int height_;
};

}  // namespace crepes
