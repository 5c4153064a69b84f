#include <fmt/core.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <string>

#include "config/calibration/imported_calibration.hpp"
#include "estimator/vision/camera_model.hpp"

// Meanings as in basalt-headers, include/basalt/calibration/calibration.hpp (struct Calibration):
//  - T_i_c, written as T_imu_cam, maps camera coordinates to IMU coordinates: p_i = T_i_c p_c. It
//  is
//    the inverse of Kalibr's T_cam_imu.
//  - cam_time_offset_ns: "with raw image timestamp t_r and this offset o [...] aligned with IMU
// clock as t_c = t_r + o". The same sign as Kalibr's timeshift_cam_imu, but in nanoseconds.
//  - gyro_noise_std, accel_noise_std: "continuous time", that is, densities; Basalt itself makes
//    them discrete by sigma_d = sigma_c sqrt(imu_update_rate). gyro_bias_std, accel_bias_std:
// "continuous time bias random walk". All four mean the same as in Kalibr, but with one value per
// axis.

namespace crepes {
namespace {

constexpr double kUnitWithin = 1e-3;

struct BasaltPose {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();

  template <class Visitor>
  void visit(Visitor& v) {
    v.required("px", p.x(), "position");
    v.required("py", p.y(), "position");
    v.required("pz", p.z(), "position");
    v.required("qx", q.x(), "quaternion");
    v.required("qy", q.y(), "quaternion");
    v.required("qz", q.z(), "quaternion");
    v.required("qw", q.w(), "quaternion");
  }
};

enum class BasaltModel : std::uint8_t { kDoubleSphere, kKannalaBrandt };
constexpr std::array kBasaltModels{Choice{"ds", BasaltModel::kDoubleSphere},
                                   Choice{"kb4", BasaltModel::kKannalaBrandt}};

struct BasaltCamera {
  BasaltModel model = BasaltModel::kDoubleSphere;

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("camera_type", model, kBasaltModels, "");
  }
};

/// In Kalibr's order.
struct DoubleSphereParameters {
  std::vector<double> intrinsics = std::vector<double>(6);

  template <class Visitor>
  void visit(Visitor& v) {
    v.required("xi", intrinsics[0], "Double Sphere");
    v.required("alpha", intrinsics[1], "Double Sphere");
    v.required("fx", intrinsics[2], "Double Sphere");
    v.required("fy", intrinsics[3], "Double Sphere");
    v.required("cx", intrinsics[4], "Double Sphere");
    v.required("cy", intrinsics[5], "Double Sphere");
  }
};

struct KannalaBrandtParameters {
  std::vector<double> intrinsics = std::vector<double>(4);
  std::vector<double> distortion_coeffs = std::vector<double>(4);

  template <class Visitor>
  void visit(Visitor& v) {
    v.required("fx", intrinsics[0], "Kannala-Brandt");
    v.required("fy", intrinsics[1], "Kannala-Brandt");
    v.required("cx", intrinsics[2], "Kannala-Brandt");
    v.required("cy", intrinsics[3], "Kannala-Brandt");
    v.required("k1", distortion_coeffs[0], "Kannala-Brandt");
    v.required("k2", distortion_coeffs[1], "Kannala-Brandt");
    v.required("k3", distortion_coeffs[2], "Kannala-Brandt");
    v.required("k4", distortion_coeffs[3], "Kannala-Brandt");
  }
};

/// The values that are not per camera.
struct BasaltRig {
  std::vector<std::array<int, 2>> resolution;
  double cam_time_offset_ns = 0.0;
  double imu_update_rate = 0.0;
  Eigen::Vector3d accel_noise_std = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_noise_std = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias_std = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_bias_std = Eigen::Vector3d::Zero();

  template <class Visitor>
  void visit(Visitor& v) {
    v.required("resolution", resolution, "[width, height] of each camera");
    v.required("cam_time_offset_ns", cam_time_offset_ns, "camera time to IMU time");
    v.required("imu_update_rate", imu_update_rate, "samples a second");
    v.required("accel_noise_std", accel_noise_std, "white noise by axis");
    v.required("gyro_noise_std", gyro_noise_std, "white noise by axis");
    v.required("accel_bias_std", accel_bias_std, "bias random walk by axis");
    v.required("gyro_bias_std", gyro_bias_std, "bias random walk by axis");
  }
};

/// The largest value of the three axes counts: Kalibr's keys hold one number.
ImuNoise imu_of(const BasaltRig& rig) {
  ImuNoise imu;
  imu.update_rate = rig.imu_update_rate;
  imu.accelerometer_noise_density = rig.accel_noise_std.maxCoeff();
  imu.gyroscope_noise_density = rig.gyro_noise_std.maxCoeff();
  imu.accelerometer_random_walk = rig.accel_bias_std.maxCoeff();
  imu.gyroscope_random_walk = rig.gyro_bias_std.maxCoeff();
  return imu;
}

/// Fills in the pose. Returns whether it is valid.
bool read_pose(const ConfigNode& node, const std::string& path, CameraCalibration& camera,
               ReadLog& log) {
  BasaltPose pose;
  if (!read_item(node, path, pose, log)) return false;
  if (std::abs(pose.q.norm() - 1.0) > kUnitWithin) {
    log.fault(path, "the quaternion's length is not 1 within 0.001");
    return false;
  }
  camera.T_cam_imu = Pose{.p = pose.p, .q = pose.q.normalized()}.inverse();
  return true;
}

/// Fills in the lens. Returns whether it is valid.
bool read_lens(const ConfigNode& node, const std::string& path, CameraCalibration& camera,
               ReadLog& log) {
  BasaltCamera lens;
  if (!read_item(node, path, lens, log)) return false;
  for (const char* key : {"camera_type", "intrinsics"}) {
    if (node.find(key) != nullptr) continue;
    log.fault(path, fmt::format("{} is missing", key));
    return false;
  }
  const ConfigNode& parameters = *node.find("intrinsics");
  const std::string parameters_path = path + ".intrinsics";
  if (lens.model == BasaltModel::kDoubleSphere) {
    DoubleSphereParameters ds;
    if (!read_item(parameters, parameters_path, ds, log)) return false;
    camera.intrinsics = ds.intrinsics;
  } else {
    KannalaBrandtParameters kb;
    if (!read_item(parameters, parameters_path, kb, log)) return false;
    camera.camera_model = CameraModelKind::kPinhole;
    camera.intrinsics = kb.intrinsics;
    camera.distortion_model = DistortionModel::kEquidistant;
    camera.distortion_coeffs = kb.distortion_coeffs;
  }
  const std::vector<CalibrationFault> faults = calibration_faults(camera);
  for (const CalibrationFault& fault : faults)
    log.fault(parameters_path, fmt::format("{}: {}", fault.key, fault.reason));
  return faults.empty();
}

}  // namespace

bool is_basalt(const ConfigNode& root) { return root.find("value0") != nullptr; }

ImportedCalibration read_basalt(const ConfigNode& root, ReadLog& log) {
  ImportedCalibration calibration;
  BasaltRig rig;
  const ConfigNode& value0 = *root.find("value0");
  if (!read_item(value0, "value0", rig, log)) return calibration;
  calibration.imu = imu_of(rig);

  for (const char* list : {"T_imu_cam", "intrinsics"}) {
    const ConfigNode* const node = value0.find(list);
    if (node != nullptr && node->is_list() && node->items.size() == rig.resolution.size()) continue;
    log.fault(fmt::format("value0.{}", list),
              fmt::format("must be a list of {}, one for each camera, as resolution is",
                          rig.resolution.size()));
    return calibration;
  }
  for (std::size_t i = 0; i < rig.resolution.size(); ++i) {
    CameraCalibration camera;
    camera.name = fmt::format("cam{}", i);
    camera.resolution = rig.resolution[i];
    camera.timeshift_cam_imu = rig.cam_time_offset_ns / 1e9;
    const bool has_pose = read_pose(value0.find("T_imu_cam")->items[i],
                                    fmt::format("value0.T_imu_cam[{}]", i), camera, log);
    const bool has_lens = read_lens(value0.find("intrinsics")->items[i],
                                    fmt::format("value0.intrinsics[{}]", i), camera, log);
    if (has_pose && has_lens) calibration.cameras.push_back(std::move(camera));
  }
  return calibration;
}

}  // namespace crepes
