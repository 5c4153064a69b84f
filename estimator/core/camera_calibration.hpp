/// Settings: camera calibration. Kalibr's names and orders.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "estimator/core/pose.hpp"
#include "estimator/core/settings_schema.hpp"

namespace crepes {

/// The projection of a camera, under the names of Kalibr.
enum class CameraModelKind : std::uint8_t { kDoubleSphere, kPinhole };
inline constexpr std::array kCameraModels{Choice{"ds", CameraModelKind::kDoubleSphere},
                                          Choice{"pinhole", CameraModelKind::kPinhole}};

/// The distortion of a camera, under the names of Kalibr.
enum class DistortionModel : std::uint8_t { kNone, kEquidistant };
inline constexpr std::array kDistortionModels{Choice{"none", DistortionModel::kNone},
                                              Choice{"equidistant", DistortionModel::kEquidistant}};

/// The calibration and frame rate of one camera.
struct CameraCalibration {
  std::string name;
  CameraModelKind camera_model = CameraModelKind::kDoubleSphere;
  std::vector<double> intrinsics;  ///< ds: xi, alpha, fx, fy, cx, cy; pinhole: fu, fv, pu, pv
  DistortionModel distortion_model = DistortionModel::kNone;
  std::vector<double> distortion_coeffs;  ///< equidistant (Kannala-Brandt): k1, k2, k3, k4
  std::array<int, 2> resolution{};
  double rate_hz = 200.0;
  Pose T_cam_imu;
  double timeshift_cam_imu = 0.0;
  /// A frame's stamp belongs to its middle row, number (height - 1) / 2; row v is exposed
  /// (v - (height - 1) / 2) times this after it. Negative where the bottom row comes first.
  double rolling_shutter_us_per_row = 0.0;
  bool calibrated = true;

  [[nodiscard]] bool operator==(const CameraCalibration&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.required("name", name, "camera name");
    v.reference("calibration",
                "Kalibr's camchain-imucam.yaml or Basalt's calibration.json, for camera_model to "
                "timeshift_cam_imu; keys in this item override it");
    v.reference("calibration_camera", "this camera's name in that file; if omitted: name");
    v.choice("camera_model", camera_model, kCameraModels,
             "projection model, Kalibr's name; ds: Double Sphere");
    v.required("intrinsics", intrinsics,
               "ds: [xi, alpha, fx, fy, cx, cy]; pinhole: [fu, fv, pu, pv]");
    v.choice("distortion_model", distortion_model, kDistortionModels,
             "ds: none; pinhole: equidistant (Kannala-Brandt)");
    v.field("distortion_coeffs", distortion_coeffs, "equidistant: [k1, k2, k3, k4]; ds: []");
    v.required("resolution", resolution, Bounds{16, 2048}, "[width, height] in pixels");
    v.field("rate_hz", rate_hz, Bounds{10, 1000}, "frames per second");
    v.required("T_cam_imu", T_cam_imu, "4x4, maps body coordinates to camera coordinates (Kalibr)");
    v.field("timeshift_cam_imu", timeshift_cam_imu, Bounds{-1, 1}, "t_imu = t_cam + shift [s]");
    v.field("rolling_shutter_us_per_row", rolling_shutter_us_per_row, Bounds{-200, 200},
            "how much later each row is exposed than the one above; a frame's stamp is that of its "
            "middle row; 0: global shutter");
    v.field("calibrated", calibrated,
            "false: lens and mounting are a guess, good enough to record and to calibrate; no pose "
            "comes from this camera");
  }
};

}  // namespace crepes
