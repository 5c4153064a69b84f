#include "config/calibration/imported_calibration.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <iterator>
#include <string_view>

#include "config/writing/config_writer.hpp"

namespace crepes {
namespace {

template <class T>
std::string line_of(std::string_view indent, std::string_view key, const T& value) {
  return fmt::format("{}{}: {}\n", indent, key, to_yaml(value));
}

std::string camera_text(const CameraCalibration& camera) {
  constexpr std::string_view kIndent = "    ";
  const bool is_double_sphere = camera.camera_model == CameraModelKind::kDoubleSphere;
  std::string text = fmt::format("  - name: {}\n    camera_model: {}\n", camera.name,
                                 is_double_sphere ? "ds" : "pinhole");
  text += line_of(kIndent, "intrinsics", camera.intrinsics);
  if (!is_double_sphere) {
    text += "    distortion_model: equidistant\n";
    text += line_of(kIndent, "distortion_coeffs", camera.distortion_coeffs);
  }
  text += line_of(kIndent, "resolution", camera.resolution);
  text += line_of(kIndent, "T_cam_imu", camera.T_cam_imu);
  text += line_of(kIndent, "timeshift_cam_imu", camera.timeshift_cam_imu);
  return camera.calibrated ? text : text + line_of(kIndent, "calibrated", false);
}

std::string imu_text(const ImuNoise& imu) {
  constexpr std::string_view kIndent = "  ";
  return "imu:\n" + line_of(kIndent, "update_rate", imu.update_rate) +
         line_of(kIndent, "accelerometer_noise_density", imu.accelerometer_noise_density) +
         line_of(kIndent, "gyroscope_noise_density", imu.gyroscope_noise_density) +
         line_of(kIndent, "accelerometer_random_walk", imu.accelerometer_random_walk) +
         line_of(kIndent, "gyroscope_random_walk", imu.gyroscope_random_walk);
}

}  // namespace

std::string calibration_text(const ImportedCalibration& calibration) {
  std::string text;
  if (!calibration.cameras.empty()) text += "cameras:\n";
  for (const CameraCalibration& camera : calibration.cameras) text += camera_text(camera);
  if (calibration.imu) text += imu_text(*calibration.imu);
  return text;
}

ImportedCalibration read_calibration(const ConfigNode& root, std::vector<ConfigFault>& faults,
                                     std::string_view only_camera) {
  ReadLog log(root);
  ImportedCalibration calibration;
  if (is_basalt(root)) {
    calibration = read_basalt(root, log);
  } else if (is_kalibr(root)) {
    calibration = read_kalibr(root, only_camera, log);
  } else {
    log.fault("",
              "neither a camchain nor an imu.yaml of Kalibr (cam0, imu0, update_rate), nor a "
              "calibration of Basalt (value0)");
  }
  std::ranges::move(log.faults, std::back_inserter(faults));
  return calibration;
}

}  // namespace crepes
