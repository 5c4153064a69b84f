#include "estimator/vision/camera_model.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

using Faults = std::vector<CalibrationFault>;

// A lens that folds nearer to its axis than this is no lens, let alone a fisheye.
constexpr double kMinMaxAngle = radians(10.0);

bool are_finite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
}

/// The last four intrinsics of every model: focal lengths and center.
Eigen::Vector4d pinhole_of(const CameraCalibration& config) {
  return Eigen::Map<const Eigen::Vector4d>(config.intrinsics.data() + config.intrinsics.size() - 4);
}

void check_pinhole(const CameraCalibration& config, Faults& faults) {
  const Eigen::Vector4d pinhole = pinhole_of(config);
  constexpr double kShortest = 10.0;  // px
  constexpr double kLongest = 1e5;
  for (const double focal : {pinhole[0], pinhole[1]}) {
    if (!(focal >= kShortest && focal <= kLongest)) {
      faults.push_back({"intrinsics", "focal lengths are 10 to 100000 px"});
      break;
    }
  }
  const auto [width, height] = config.resolution;
  if (width > 0 &&
      !(pinhole[2] >= 0 && pinhole[2] <= width && pinhole[3] >= 0 && pinhole[3] <= height))
    faults.push_back({"intrinsics", "the center, the last two, lies outside the resolution"});
}

Faults double_sphere_faults(const CameraCalibration& config) {
  Faults faults;
  if (config.distortion_model != DistortionModel::kNone)
    faults.push_back({"distortion_model", "ds has no distortion: must be none"});
  if (!config.distortion_coeffs.empty())
    faults.push_back({"distortion_coeffs", "ds has no distortion: must be empty"});
  const std::vector<double>& v = config.intrinsics;
  if (v.size() != 6) {
    faults.push_back(
        {"intrinsics",
         fmt::format("ds has 6 intrinsics (xi, alpha, fx, fy, cx, cy), not {}", v.size())});
  } else if (!are_finite(v)) {
    faults.push_back({"intrinsics", "not finite"});
  } else {
    if (!(v[0] > -1 && v[0] < 1))
      faults.push_back({"intrinsics", "xi, the first, is outside (-1, 1)"});
    if (!(v[1] >= 0 && v[1] <= 1))
      faults.push_back({"intrinsics", "alpha, the second, is outside [0, 1]"});
    check_pinhole(config, faults);
  }
  return faults;
}

KannalaBrandt kannala_brandt_of(const std::vector<double>& k) {
  return KannalaBrandt({k[0], k[1], k[2], k[3]});
}

Faults kannala_brandt_faults(const CameraCalibration& config) {
  Faults faults;
  if (config.distortion_model != DistortionModel::kEquidistant)
    faults.push_back({"distortion_model", "must be equidistant for pinhole"});
  const std::vector<double>& k = config.distortion_coeffs;
  if (k.size() != 4) {
    faults.push_back(
        {"distortion_coeffs", fmt::format("equidistant has 4 (k1, k2, k3, k4), not {}", k.size())});
  } else if (!are_finite(k)) {
    faults.push_back({"distortion_coeffs", "not finite"});
  } else if (kannala_brandt_of(k).max_angle_rad() < kMinMaxAngle) {
    faults.push_back({"distortion_coeffs", "the image folds less than 10 degrees off the axis"});
  }
  if (config.intrinsics.size() != 4) {
    faults.push_back({"intrinsics", fmt::format("pinhole has 4 intrinsics (fu, fv, pu, pv), not {}",
                                                config.intrinsics.size())});
  } else if (!are_finite(config.intrinsics)) {
    faults.push_back({"intrinsics", "not finite"});
  } else {
    check_pinhole(config, faults);
  }
  return faults;
}

}  // namespace

Faults calibration_faults(const CameraCalibration& config) {
  Faults faults = config.camera_model == CameraModelKind::kDoubleSphere
                      ? double_sphere_faults(config)
                      : kannala_brandt_faults(config);
  if (config.resolution[0] <= 0 || config.resolution[1] <= 0)
    faults.push_back({"resolution", "must be positive"});
  return faults;
}

CameraModel::CameraModel(const Lens& lens, const Eigen::Vector4d& pinhole,
                         std::array<int, 2> resolution)
    : lens_(lens),
      focal_(pinhole.head<2>()),
      center_(pinhole.tail<2>()),
      width_(resolution[0]),
      height_(resolution[1]) {}

Result<CameraModel> CameraModel::from(const CameraCalibration& config) {
  if (const Faults faults = calibration_faults(config); !faults.empty()) {
    const CalibrationFault& first = faults.front();
    return fail(ErrorCode::kConfig,
                "camera " + config.name + ": " + std::string(first.key) + ": " + first.reason);
  }
  const Lens lens = config.camera_model == CameraModelKind::kDoubleSphere
                        ? Lens(DoubleSphere(config.intrinsics[0], config.intrinsics[1]))
                        : Lens(kannala_brandt_of(config.distortion_coeffs));
  return CameraModel(lens, pinhole_of(config), config.resolution);
}

std::optional<Eigen::Vector2d> CameraModel::project(const Eigen::Vector3d& p_C,
                                                    ProjectionJacobian* J) const {
  const auto m = std::visit([&](const auto& lens) { return lens.project(p_C, J); }, lens_);
  if (!m) return std::nullopt;
  if (J != nullptr) *J = focal_.asDiagonal() * *J;
  return focal_.cwiseProduct(*m) + center_;
}

std::optional<Eigen::Vector3d> CameraModel::unproject(const Eigen::Vector2d& uv,
                                                      UnprojectionJacobian* J) const {
  const Eigen::Vector2d m = (uv - center_).cwiseQuotient(focal_);
  auto u_C = std::visit([&](const auto& lens) { return lens.unproject(m, J); }, lens_);
  if (u_C && J != nullptr) *J = *J * focal_.cwiseInverse().asDiagonal();
  return u_C;
}

bool CameraModel::contains(const Eigen::Vector2d& uv) const {
  return uv.x() >= -0.5 && uv.y() >= -0.5 && uv.x() < width_ - 0.5 && uv.y() < height_ - 0.5;
}

}  // namespace crepes
