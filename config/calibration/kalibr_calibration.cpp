#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "config/calibration/imported_calibration.hpp"
#include "estimator/vision/camera_model.hpp"

namespace crepes {
namespace {

constexpr std::size_t kMaxKalibrCameras = 16;

/// Where a camera of a camchain is.
struct KalibrMounting {
  std::optional<Pose> T_cam_imu;
  std::optional<Pose> T_cam_before;  ///< from the camera before to this one

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("T_cam_imu", T_cam_imu, "");
    v.field("T_cn_cnm1", T_cam_before, "");
  }
};

/// What else is said of it. Other keys (rostopic, cam_overlaps, ...) are ignored.
struct KalibrCamera {
  CameraCalibration config;

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("camera_model", config.camera_model, kCameraModels, "");
    v.required("intrinsics", config.intrinsics, "projection parameters");
    v.choice("distortion_model", config.distortion_model, kDistortionModels, "");
    v.field("distortion_coeffs", config.distortion_coeffs, "");
    v.required("resolution", config.resolution, "[width, height]");
    v.field("timeshift_cam_imu", config.timeshift_cam_imu, "");
    v.field("calibrated", config.calibrated, "");
  }
};

struct KalibrImu {
  ImuNoise config;
  std::string model = "calibrated";  ///< of intrinsics

  template <class Visitor>
  void visit(Visitor& v) {
    v.required("update_rate", config.update_rate, "samples a second");
    v.required("accelerometer_noise_density", config.accelerometer_noise_density, "white noise");
    v.required("gyroscope_noise_density", config.gyroscope_noise_density, "white noise");
    v.required("accelerometer_random_walk", config.accelerometer_random_walk, "bias diffusion");
    v.required("gyroscope_random_walk", config.gyroscope_random_walk, "bias diffusion");
    v.field("model", model, "");
  }
};

std::string camera_name(std::size_t i) { return fmt::format("cam{}", i); }

/// T_cam_imu, or computed from the previous camera: T_cn_imu = T_cn_cnm1 T_cnm1_imu.
std::optional<Pose> pose_of(const KalibrMounting& camera, const std::optional<Pose>& T_before_imu) {
  if (camera.T_cam_imu) return camera.T_cam_imu;
  if (!camera.T_cam_before || !T_before_imu) return std::nullopt;
  return *camera.T_cam_before * *T_before_imu;
}

/// Empty if it has faults.
std::optional<CameraCalibration> read_camera(const ConfigNode& node, const std::string& name,
                                             const Pose& T_cam_imu, ReadLog& log) {
  KalibrCamera camera;
  if (!read_item(node, name, camera, log)) return std::nullopt;
  if (node.find("camera_model") == nullptr) {
    log.fault(name, "camera_model is missing");
    return std::nullopt;
  }
  camera.config.name = name;
  camera.config.T_cam_imu = T_cam_imu;
  for (CalibrationFault& fault : calibration_faults(camera.config))
    log.fault(fmt::format("{}.{}", name, fault.key), std::move(fault.reason));
  return camera.config;
}

void check_gaps(const ConfigNode& root, std::size_t cameras, ReadLog& log) {
  for (std::size_t i = cameras + 1; i < kMaxKalibrCameras; ++i) {
    if (root.find(camera_name(i)) != nullptr)
      log.fault(camera_name(i), camera_name(cameras) + " before it is missing");
  }
}

void read_cameras(const ConfigNode& root, std::string_view only,
                  std::vector<CameraCalibration>& cameras, ReadLog& log) {
  std::optional<Pose> T_cam_imu;
  for (std::size_t i = 0; i < kMaxKalibrCameras; ++i) {
    const std::string name = camera_name(i);
    const ConfigNode* const node = root.find(name);
    if (node == nullptr) return check_gaps(root, i, log);
    KalibrMounting mounting;
    if (!read_item(*node, name, mounting, log)) return;
    T_cam_imu = pose_of(mounting, T_cam_imu);
    if (!only.empty() && name != only) continue;
    if (!T_cam_imu) {
      const bool has_inverse = node->find("T_imu_cam") != nullptr;
      return log.fault(
          name, has_inverse ? "no T_cam_imu: it is the inverse of T_imu_cam"
                            : "no T_cam_imu: a camchain of kalibr_calibrate_cameras does not know "
                              "the IMU; give that of kalibr_calibrate_imu_camera");
    }
    auto camera = read_camera(*node, name, *T_cam_imu, log);
    if (!camera) return;
    cameras.push_back(std::move(*camera));
  }
}

}  // namespace

bool is_kalibr(const ConfigNode& root) {
  constexpr std::array<std::string_view, 4> kKeys{"cam0", "imu0", "update_rate",
                                                  "accelerometer_noise_density"};
  return std::ranges::any_of(kKeys,
                             [&](std::string_view key) { return root.find(key) != nullptr; });
}

ImportedCalibration read_kalibr(const ConfigNode& root, std::string_view only_camera,
                                ReadLog& log) {
  ImportedCalibration calibration;
  const bool has_cameras = root.find("cam0") != nullptr;
  if (has_cameras) read_cameras(root, only_camera, calibration.cameras, log);
  // Kalibr's input file is flat; its output has the same keys below imu0.
  KalibrImu imu;
  const ConfigNode* const nested = root.find("imu0");
  if (nested == nullptr && has_cameras) return calibration;
  if (nested == nullptr ? read_item(root, "", imu, log) : read_item(*nested, "imu0", imu, log))
    calibration.imu = imu.config;
  if (imu.model != "calibrated") {
    const std::string path = nested == nullptr ? "" : "imu0";
    log.fault(path + (path.empty() ? "model" : ".model"),
              fmt::format("{}: such intrinsics are not read, and T_cam_imu belongs to them; "
                          "calibrate with \"calibrated\", after crepesctl calibrate imu",
                          imu.model));
  }
  return calibration;
}

}  // namespace crepes
