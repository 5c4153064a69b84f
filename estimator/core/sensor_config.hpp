/// Settings: cameras, inertial sensor, ranging module, and the devices that deliver them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "estimator/core/config_schema.hpp"
#include "estimator/core/pose.hpp"

namespace crepes {

enum class CameraModelKind : std::uint8_t { kDoubleSphere, kPinhole };
inline constexpr std::array kCameraModels{Choice{"ds", CameraModelKind::kDoubleSphere},
                                          Choice{"pinhole", CameraModelKind::kPinhole}};

enum class DistortionModel : std::uint8_t { kNone, kEquidistant };
inline constexpr std::array kDistortionModels{Choice{"none", DistortionModel::kNone},
                                              Choice{"equidistant", DistortionModel::kEquidistant}};

enum class CameraDriver : std::uint8_t { kNone, kFolder, kAravis, kV4l2, kMindVision };
inline constexpr std::array kCameraDrivers{
    Choice{"none", CameraDriver::kNone}, Choice{"folder", CameraDriver::kFolder},
    Choice{"aravis", CameraDriver::kAravis}, Choice{"v4l2", CameraDriver::kV4l2},
    Choice{"mindvision", CameraDriver::kMindVision}};

enum class CameraTrigger : std::uint8_t { kFree, kHardware };
inline constexpr std::array kCameraTriggers{Choice{"free", CameraTrigger::kFree},
                                            Choice{"hardware", CameraTrigger::kHardware}};

/// One camera, with Kalibr's names and orders.
struct CameraConfig {
  std::string name;
  CameraModelKind camera_model = CameraModelKind::kDoubleSphere;
  std::vector<double> intrinsics;  ///< ds: xi, alpha, fx, fy, cx, cy; pinhole: fu, fv, pu, pv
  DistortionModel distortion_model = DistortionModel::kNone;
  std::vector<double> distortion_coeffs;  ///< equidistant (Kannala-Brandt): k1, k2, k3, k4
  std::array<int, 2> resolution{};
  double rate_hz = 200.0;
  Pose T_cam_imu;
  double timeshift_cam_imu = 0.0;
  CameraDriver driver = CameraDriver::kNone;
  std::string folder;
  std::string device;
  std::optional<double> exposure_us;
  std::optional<double> gain;
  std::array<int, 2> offset{};
  CameraTrigger trigger = CameraTrigger::kFree;
  std::string trigger_source = "Line1";
  int packet_size = 0;
  double latency_ms = 5.0;
  std::string library = "libMVSDK.so";

  template <class Visitor>
  void visit(Visitor& v) {
    v.required("name", name, "camera name");
    v.reference("calibration",
                "Kalibr's camchain-imucam.yaml or Basalt's calibration.json, for camera_model to "
                "timeshift_cam_imu; keys given here go before it");
    v.reference("calibration_camera", "this camera's name in there; left out: as name");
    v.choice("camera_model", camera_model, kCameraModels,
             "projection model, Kalibr's name; ds: Double Sphere");
    v.required("intrinsics", intrinsics,
               "ds: [xi, alpha, fx, fy, cx, cy]; pinhole: [fu, fv, pu, pv]");
    v.choice("distortion_model", distortion_model, kDistortionModels,
             "ds: none; pinhole: equidistant (Kannala-Brandt)");
    v.field("distortion_coeffs", distortion_coeffs, "equidistant: [k1, k2, k3, k4]; ds: []");
    v.required("resolution", resolution, Bounds{16, 2048}, "[width, height] in pixels");
    v.field("rate_hz", rate_hz, Bounds{10, 1000}, "frames a second");
    v.required("T_cam_imu", T_cam_imu, "4x4, maps body coordinates to camera coordinates (Kalibr)");
    v.field("timeshift_cam_imu", timeshift_cam_imu, Bounds{-1, 1}, "t_imu = t_cam + shift [s]");
    v.choice("driver", driver, kCameraDrivers,
             "where frames come from; aravis: USB3 Vision and GigE Vision");
    v.field("folder", folder, "driver folder: the directory of pictures, with data.csv beside it");
    v.field("device", device,
            "aravis: id as told by `crepesctl devices`, or address; v4l2: best under "
            "/dev/v4l/by-id; mindvision: serial number; left out: the only one");
    v.field("exposure_us", exposure_us, Bounds{1, 100000},
            "shorter than a frame; left out: as the device has it");
    v.field("gain", gain, Bounds{0, 1000},
            "in the device's own unit (aravis: dB as a rule); left out: as the device has it");
    v.field("offset", offset, Bounds{0, 16384},
            "[x, y] on the sensor of the region that is read out; its size is resolution");
    v.choice("trigger", trigger, kCameraTriggers, "free: at rate_hz; hardware: a pulse a frame");
    v.field("trigger_source", trigger_source, "aravis: the input of those pulses");
    v.field("packet_size", packet_size, Bounds{0, 65535},
            "GigE Vision: bytes, 9000 with jumbo frames; 0: the camera's own");
    v.field("latency_ms", latency_ms, Bounds{0, 100},
            "from the middle of the exposure to the frame's arrival");
    v.field("library", library, "mindvision: the vendor's library");
  }
};

enum class ImuProtocol : std::uint8_t { kAuto, kWitMotion, kHipnuc, kXsens, kMavlink };
inline constexpr std::array kImuProtocols{
    Choice{"auto", ImuProtocol::kAuto}, Choice{"witmotion", ImuProtocol::kWitMotion},
    Choice{"hipnuc", ImuProtocol::kHipnuc}, Choice{"xsens", ImuProtocol::kXsens},
    Choice{"mavlink", ImuProtocol::kMavlink}};

/// What makes of a sensor's reading v the true T K (v - b), as imu_tk calibrates it.
struct TriadConfig {
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  Eigen::Matrix3d misalignment = Eigen::Matrix3d::Identity();

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("bias", bias, "b, taken off first, in the unit of the readings");
    v.field("scale", scale, Bounds{0.5, 2}, "the diagonal of K");
    v.field("misalignment", misalignment, Bounds{-2, 2}, "T, 3 rows of 3 numbers");
  }
};

/// Noise under Kalibr's names (imu.yaml), one-sigma priors, the serial line, and how readings
/// become the body's.
struct ImuConfig {
  double update_rate = 100.0;
  double accelerometer_noise_density = 0.0018;
  double gyroscope_noise_density = 0.00037;
  double accelerometer_random_walk = 0.0002;
  double gyroscope_random_walk = 0.0001;
  double accelerometer_bias_sigma = 0.035;
  double gyroscope_bias_sigma = 0.005;
  double accelerometer_scale_sigma = 0.002;
  double gyroscope_scale_sigma = 0.003;
  std::string port;
  int baud = 115200;
  ImuProtocol protocol = ImuProtocol::kAuto;
  Pose T_body_imu;
  TriadConfig accelerometer;
  TriadConfig gyroscope;

  template <class Visitor>
  void visit(Visitor& v) {
    v.reference("calibration",
                "Kalibr's imu.yaml or Basalt's calibration.json, for update_rate to "
                "gyroscope_random_walk; keys given here go before it");
    v.field("update_rate", update_rate, Bounds{10, 2000}, "samples a second");
    v.field("accelerometer_noise_density", accelerometer_noise_density, Bounds{1e-5, 1},
            "white noise [m/s^2/sqrt(Hz)]");
    v.field("gyroscope_noise_density", gyroscope_noise_density, Bounds{1e-6, 1},
            "white noise [rad/s/sqrt(Hz)]");
    v.field("accelerometer_random_walk", accelerometer_random_walk, Bounds{0, 1},
            "bias random walk [m/s^3/sqrt(Hz)]");
    v.field("gyroscope_random_walk", gyroscope_random_walk, Bounds{0, 1},
            "bias random walk [rad/s^2/sqrt(Hz)]");
    v.field("accelerometer_bias_sigma", accelerometer_bias_sigma, Bounds{0, 5},
            "prior of the bias at start, one sigma [m/s^2]");
    v.field("gyroscope_bias_sigma", gyroscope_bias_sigma, Bounds{0, 1},
            "prior of the bias at start, one sigma [rad/s]");
    v.field("accelerometer_scale_sigma", accelerometer_scale_sigma, Bounds{0, 0.1},
            "scale and axis errors that calibration left, each, one sigma");
    v.field("gyroscope_scale_sigma", gyroscope_scale_sigma, Bounds{0, 0.1},
            "scale and axis errors that calibration left, each, one sigma");
    v.field("port", port, "serial device, best under /dev/serial/by-id");
    v.field("baud", baud, Bounds{1200, 4000000}, "bits a second");
    v.choice("protocol", protocol, kImuProtocols, "what the device speaks; auto: find out");
    v.field("T_body_imu", T_body_imu,
            "4x4, how the sensor's axes lie in the body's; no translation, the body is at the IMU");
    v.section("accelerometer", accelerometer,
              "correction T K (v - b) in the sensor's axes [m/s^2]");
    v.section("gyroscope", gyroscope, "correction T K (v - b) in the sensor's axes [rad/s]");
  }
};

struct UwbConfig {
  double noise_m = 0.05;
  double bias_sigma_m = 0.05;
  double bias_drift_m = 0.01;
  double bias_time_s = 10.0;
  double max_range_m = 200.0;
  double late_path_db = 8.0;
  std::string port;
  int baud = 921600;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("noise_m", noise_m, Bounds{0.001, 2}, "one sigma of a single range");
    v.field("bias_sigma_m", bias_sigma_m, Bounds{0, 2}, "constant bias of a pair, one sigma");
    v.field("bias_drift_m", bias_drift_m, Bounds{0, 2},
            "how far the bias wanders within bias_time_s, as antennas turn");
    v.field("bias_time_s", bias_time_s, Bounds{0.1, 1000}, "see bias_drift_m [s]");
    v.field("max_range_m", max_range_m, Bounds{1, 1000}, "ranges above are refused");
    v.field(
        "late_path_db", late_path_db, Bounds{1, 40},
        "received above first-path power by more than this: no line of sight, the range is long");
    v.field("port", port, "serial device, best under /dev/serial/by-id");
    v.field("baud", baud, Bounds{1200, 4000000}, "bits a second");
  }
};

}  // namespace crepes
