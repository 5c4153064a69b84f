#include "daemon/ctl/calibrate/camchain.hpp"

#include <fmt/core.h>

#include <vector>

#include "config/writing/config_writer.hpp"

namespace crepes {
namespace {

std::string mounting_text(const CameraCalibration& camera) {
  const Eigen::Matrix3d R = camera.T_cam_imu.R();
  std::string text = "  T_cam_imu:\n";
  for (int i = 0; i < 3; ++i)
    text += fmt::format(
        "  - {}\n", to_yaml(std::vector<double>{R(i, 0), R(i, 1), R(i, 2), camera.T_cam_imu.p[i]}));
  return text + fmt::format("  - [0.0, 0.0, 0.0, 1.0]\n  timeshift_cam_imu: {}\n",
                            to_yaml(camera.timeshift_cam_imu));
}

}  // namespace

CameraCalibration calibration_of(const CameraConstants& constants,
                                 const std::array<int, 2>& resolution,
                                 const std::optional<KannalaBrandtFit>& kb) {
  CameraCalibration camera;
  camera.intrinsics.assign(constants.lens.begin(), constants.lens.end());
  if (kb) {
    camera.camera_model = CameraModelKind::kPinhole;
    camera.intrinsics.assign(kb->pinhole.begin(), kb->pinhole.end());
    camera.distortion_model = DistortionModel::kEquidistant;
    camera.distortion_coeffs.assign(kb->k.begin(), kb->k.end());
  }
  camera.resolution = resolution;
  camera.T_cam_imu = constants.T_C_B();
  camera.timeshift_cam_imu = constants.shift_s;
  return camera;
}

std::string camchain_text(const CameraCalibration& camera, Mounting mounting,
                          std::string_view command) {
  const bool is_sphere = camera.camera_model == CameraModelKind::kDoubleSphere;
  return fmt::format(
             "# Written by crepesctl calibrate {}\ncam0:\n  camera_model: {}\n  intrinsics: {}\n"
             "  distortion_model: {}\n  distortion_coeffs: {}\n  resolution: {}\n",
             command, is_sphere ? "ds" : "pinhole", to_yaml(camera.intrinsics),
             is_sphere ? "none" : "equidistant", to_yaml(camera.distortion_coeffs),
             to_yaml(camera.resolution)) +
         (mounting == Mounting::kKnown ? mounting_text(camera) : "");
}

}  // namespace crepes
