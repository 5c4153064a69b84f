#include "estimator/calibration/grid/grid_lens.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/calibration/camera/camera_start.hpp"
#include "estimator/vision/double_sphere.hpp"
#include "estimator/vision/kannala_brandt.hpp"

namespace crepes {
namespace {

bool is_sphere(const GridLens& lens) { return lens.kind == LensKind::kDoubleSphere; }

Eigen::Vector2d focal_of(const GridLens& lens) {
  return lens.numbers.segment<2>(is_sphere(lens) ? 2 : 0);
}

DoubleSphere sphere_of(const GridLens& lens) { return {lens.numbers[0], lens.numbers[1]}; }

KannalaBrandt polynomial_of(const GridLens& lens) {
  return KannalaBrandt({lens.numbers[4], lens.numbers[5], lens.numbers[6], lens.numbers[7]});
}

}  // namespace

Eigen::Vector2d GridLens::center() const { return numbers.segment<2>(is_sphere(*this) ? 4 : 2); }

std::optional<Eigen::Vector2d> GridLens::project(const Eigen::Vector3d& p_C) const {
  const auto m = is_sphere(*this) ? sphere_of(*this).project(p_C, nullptr)
                                  : polynomial_of(*this).project(p_C, nullptr);
  if (!m) return std::nullopt;
  return focal_of(*this).cwiseProduct(*m) + center();
}

std::optional<Eigen::Vector3d> GridLens::direction(const Eigen::Vector2d& uv) const {
  const Eigen::Vector2d m = (uv - center()).cwiseQuotient(focal_of(*this));
  return is_sphere(*this) ? sphere_of(*this).unproject(m, nullptr)
                          : polynomial_of(*this).unproject(m, nullptr);
}

CameraCalibration GridLens::calibration(const std::array<int, 2>& resolution) const {
  CameraCalibration camera;
  camera.resolution = resolution;
  camera.camera_model =
      is_sphere(*this) ? CameraModelKind::kDoubleSphere : CameraModelKind::kPinhole;
  const Eigen::Index intrinsics = is_sphere(*this) ? 6 : 4;
  camera.intrinsics.assign(numbers.begin(), numbers.begin() + intrinsics);
  camera.distortion_model =
      is_sphere(*this) ? DistortionModel::kNone : DistortionModel::kEquidistant;
  camera.distortion_coeffs.assign(numbers.begin() + intrinsics, numbers.end());
  return camera;
}

bool GridLens::is_valid() const {
  if (!numbers.allFinite() || focal_of(*this).minCoeff() <= 1.0) return false;
  if (!is_sphere(*this)) return true;
  constexpr double kMostXi = 0.99;
  return std::abs(numbers[0]) < kMostXi && numbers[1] > 0.0 && numbers[1] < 1.0;
}

GridLens generic_grid_lens(LensKind kind, const std::array<int, 2>& resolution, double fov_rad,
                           double scale) {
  GridLens lens{.kind = kind, .numbers = {}};
  if (kind == LensKind::kDoubleSphere) {
    lens.numbers = generic_lens(resolution[0], resolution[1], fov_rad);
    lens.numbers.segment<2>(2) *= scale;
    return lens;
  }
  const double f = scale * std::min(resolution[0], resolution[1]) / fov_rad;
  lens.numbers = Eigen::VectorXd::Zero(8);
  lens.numbers.head<4>() << f, f, 0.5 * (resolution[0] - 1), 0.5 * (resolution[1] - 1);
  return lens;
}

}  // namespace crepes
