/// Settings: one camera, its calibration and the device that delivers its frames.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "drivers/camera/camera_light.hpp"
#include "estimator/core/camera_calibration.hpp"
#include "estimator/core/settings_schema.hpp"

namespace crepes {

/// The program interface of a camera.
enum class CameraDriver : std::uint8_t { kNone, kFolder, kAravis, kV4l2, kLibcamera, kMindVision };
inline constexpr std::array kCameraDrivers{
    Choice{"none", CameraDriver::kNone},           Choice{"folder", CameraDriver::kFolder},
    Choice{"aravis", CameraDriver::kAravis},       Choice{"v4l2", CameraDriver::kV4l2},
    Choice{"libcamera", CameraDriver::kLibcamera}, Choice{"mindvision", CameraDriver::kMindVision}};

/// What starts an exposure.
enum class CameraTrigger : std::uint8_t { kFree, kHardware };
inline constexpr std::array kCameraTriggers{Choice{"free", CameraTrigger::kFree},
                                            Choice{"hardware", CameraTrigger::kHardware}};

/// Where frames come from, and how the device is set.
struct CameraDeviceConfig {
  CameraDriver driver = CameraDriver::kNone;
  std::string folder;
  std::string id;
  CameraLight light;
  ExposureControl exposure = ExposureControl::kFixed;
  std::array<int, 2> offset{};
  CameraTrigger trigger = CameraTrigger::kFree;
  std::string trigger_source = "Line1";
  int packet_size = 0;
  double latency_ms = 5.0;
  std::string library = "libMVSDK.so";

  [[nodiscard]] bool operator==(const CameraDeviceConfig&) const = default;
  [[nodiscard]] LightSettings light_settings() const { return {light, exposure}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("driver", driver, kCameraDrivers,
             "where frames come from; aravis: USB3 Vision and GigE Vision");
    v.field("folder", folder, "driver folder: the directory of pictures, with data.csv beside it");
    v.field("device", id,
            "aravis: id from `crepesctl devices`, or address; v4l2: best a name under "
            "/dev/v4l/by-id; libcamera: id from `crepesctl devices`; mindvision: serial number; if "
            "omitted: the only device");
    v.field("exposure_us", light.exposure_us, Bounds{1, 100000},
            "exposure time, shorter than a frame; if omitted: the device's setting (live)");
    v.choice("exposure", exposure, kExposureControls,
             "fixed; auto: exposure_us at most, and shorter while boards are near (live)");
    v.field("gain", light.gain, Bounds{0, 1000},
            "in the device's own unit (aravis: usually dB); if omitted: the device's setting "
            "(live)");
    v.field("offset", offset, Bounds{0, 16384},
            "[x, y] of the sensor region that is read out; its size is resolution");
    v.choice("trigger", trigger, kCameraTriggers,
             "free: at rate_hz; hardware: one pulse per frame");
    v.field("trigger_source", trigger_source, "aravis: the input line of the trigger pulses");
    v.field("packet_size", packet_size, Bounds{0, 65535},
            "GigE Vision: bytes, 9000 with jumbo frames; 0: the camera's own");
    v.field("latency_ms", latency_ms, Bounds{0, 100},
            "delay from the middle of the exposure to the frame's arrival");
    v.field("library", library, "mindvision: the vendor's library");
  }
};

struct CameraConfig {
  CameraCalibration calibration;
  CameraDeviceConfig device;

  [[nodiscard]] bool operator==(const CameraConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    calibration.visit(v);
    device.visit(v);
  }
};

}  // namespace crepes
