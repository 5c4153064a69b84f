/// Every setting, once: its key, default, bounds and meaning.
///
/// Each struct is a plain aggregate whose defaults are the documented defaults; `visit(v)` lists
/// its fields for the reader, the writer and the reference file alike:
///   v.required(key, member, [bounds,] help)    must be in the file
///   v.field(key, member, [bounds,] help)       may be left out
///   v.choice(key, member, choices, help)       an enumeration by name
///   v.section(key, member, help)               a nested struct
///   v.list(key, member, help)                  a sequence of structs
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/core/measurements.hpp"
#include "estimator/core/pose.hpp"

namespace crepes {

/// Closed interval of what a number may be.
struct Bounds {
  double min;
  double max;
};

template <class Enum>
struct Choice {
  std::string_view name;
  Enum value;
};
template <class Enum>
Choice(const char*, Enum) -> Choice<Enum>;  // which clang-tidy 14 cannot deduce for an aggregate
template <class Enum>
Choice(std::string_view, Enum) -> Choice<Enum>;

struct RobotConfig {
  RobotId id{};

  template <class Visitor>
  void visit(Visitor& v) {
    v.required("id", id, Bounds{1, 65534}, "this robot's id; must be one of swarm.members");
  }
};

/// One robot of the swarm: how it blinks and where its LED ring and antenna are mounted.
struct MemberConfig {
  RobotId id{};
  std::string name;
  std::optional<std::string> pattern;
  std::optional<double> duty;
  std::optional<int> uwb_id;
  Eigen::Vector3d p_body_led = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_body_uwb = Eigen::Vector3d::Zero();

  template <class Visitor>
  void visit(Visitor& v) {
    v.required("id", id, Bounds{1, 65534}, "robot id");
    v.required("name", name, "robot name, as in outputs");
    v.field("pattern", pattern,
            "blink pattern, one character a slot: 1 lit, 0 dark; either this or duty");
    v.field("duty", duty, Bounds{0.05, 0.95},
            "lit part of swarm.period_ms; either this or pattern");
    v.field("uwb_id", uwb_id, Bounds{0, 65535}, "id of the UWB module; left out: the robot id");
    v.field("p_body_led", p_body_led, Bounds{-5, 5},
            "center of the LED ring in the body frame [m]");
    v.field("p_body_uwb", p_body_uwb, Bounds{-5, 5}, "UWB antenna in the body frame [m]");
  }
};

struct SwarmConfig {
  double slot_ms = 10.0;
  double period_ms = 50.0;
  std::vector<MemberConfig> members;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("slot_ms", slot_ms, Bounds{2, 50}, "one bit of a blink pattern");
    v.field("period_ms", period_ms, Bounds{10, 200}, "one period of a duty-coded board");
    v.list("members", members, "everyone in the swarm, this robot included");
  }
};

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
  double scale_sigma = 0.003;
  std::string port;
  int baud = 115200;
  ImuProtocol protocol = ImuProtocol::kAuto;
  Pose T_body_imu;
  TriadConfig accelerometer;
  TriadConfig gyroscope;

  template <class Visitor>
  void visit(Visitor& v) {
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
    v.field("scale_sigma", scale_sigma, Bounds{0, 0.1},
            "scale and axis errors that calibration left, one sigma; noise that grows with rate");
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

enum class SpotDetectorKind : std::uint8_t { kFast, kHough };
inline constexpr std::array kSpotDetectors{Choice{"fast", SpotDetectorKind::kFast},
                                           Choice{"hough", SpotDetectorKind::kHough}};

/// Images to spots to identified bearings.
struct VisionConfig {
  SpotDetectorKind detector = SpotDetectorKind::kFast;
  int threshold = 0;
  double min_area_px2 = 1.5;
  double max_area_px2 = 20000.0;
  int max_spots = 256;
  double bearing_sigma_px = 0.2;
  double gate_px = 8.0;
  double track_timeout_ms = 150.0;
  double max_wrong_id = 5e-7;
  double max_false_robot = 1e-5;
  double flip_rate = 0.02;

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("detector", detector, kSpotDetectors, "fast: ours; hough: the paper's pipeline");
    v.field("threshold", threshold, Bounds{0, 255},
            "grey level that separates spots; 0: automatic");
    v.field("min_area_px2", min_area_px2, Bounds{0, 1000}, "smaller spots are hot pixels");
    v.field("max_area_px2", max_area_px2, Bounds{10, 4e6}, "larger spots are the sun");
    v.field("max_spots", max_spots, Bounds{1, 4096},
            "the brightest so many spots a frame are kept");
    v.field("bearing_sigma_px", bearing_sigma_px, Bounds{0.01, 10}, "one sigma of a spot's center");
    v.field("gate_px", gate_px, Bounds{1, 100},
            "a spot this far from a track's prediction is another's");
    v.field("track_timeout_ms", track_timeout_ms, Bounds{10, 5000}, "a track dark for longer ends");
    v.field("max_wrong_id", max_wrong_id, Bounds{1e-12, 0.1},
            "an ID is given once the probability of all others is below this");
    v.field("max_false_robot", max_false_robot, Bounds{1e-12, 0.1},
            "... and the probability that the source is no board, below this");
    v.field("flip_rate", flip_rate, Bounds{1e-6, 0.3},
            "part of the frames that show the wrong state");
  }
};

enum class Profile : std::uint8_t { kTight, kPaper };
inline constexpr std::array kProfiles{Choice{"tight", Profile::kTight},
                                      Choice{"paper", Profile::kPaper}};

/// The filters.
struct EstimatorConfig {
  Profile profile = Profile::kTight;
  double lag_ms = 100.0;
  double output_rate_hz = 50.0;
  double camera_misalignment_deg = 0.2;
  double gate_probability = 0.999;
  double predicted_after_s = 0.5;
  double forget_after_s = 30.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("profile", profile, kProfiles, "tight: every measurement by itself; paper: raw poses");
    v.field("lag_ms", lag_ms, Bounds{5, 1000}, "how long late data are waited for; poses are not");
    v.field("output_rate_hz", output_rate_hz, Bounds{1, 200}, "poses a second");
    v.field("camera_misalignment_deg", camera_misalignment_deg, Bounds{0, 10},
            "error of T_cam_imu's rotation, one sigma");
    v.field("gate_probability", gate_probability, Bounds{0.9, 0.9999999},
            "measurements less likely than this are refused");
    v.field("predicted_after_s", predicted_after_s, Bounds{0.05, 60},
            "a pose without a measurement for longer is called predicted");
    v.field("forget_after_s", forget_after_s, Bounds{1, 3600}, "a silent neighbor is forgotten");
  }
};

enum class GraphCost : std::uint8_t { kLie, kPaper };
inline constexpr std::array kGraphCosts{Choice{"lie", GraphCost::kLie},
                                        Choice{"paper", GraphCost::kPaper}};

/// The pose graph over the whole team.
struct GraphConfig {
  bool enabled = true;
  double rate_hz = 10.0;
  GraphCost cost = GraphCost::kLie;
  double kernel_scale = 3.0;
  int max_iterations = 20;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("enabled", enabled, "solve the pose graph");
    v.field("rate_hz", rate_hz, Bounds{0.1, 100}, "solutions a second");
    v.choice("cost", cost, kGraphCosts, "lie: weighted by covariance; paper: ||T X^-1 X - I||_F^2");
    v.field("kernel_scale", kernel_scale, Bounds{0.1, 100},
            "residual norm [sigmas] from which the robust kernel bends");
    v.field("max_iterations", max_iterations, Bounds{1, 1000}, "bound of one solution");
  }
};

/// Peers on the mesh.
struct NetConfig {
  std::string interface = "bat0";
  int port = 47474;
  double report_rate_hz = 50.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("interface", interface, "mesh interface to broadcast on; lo reaches this machine only");
    v.field("port", port, Bounds{1, 65535}, "UDP port of peer traffic");
    v.field("report_rate_hz", report_rate_hz, Bounds{1, 200}, "broadcasts a second");
  }
};

/// Poses for programs on the robot.
struct SubscriptionConfig {
  std::vector<std::string> listen{"127.0.0.1", "::1"};
  int port = 47475;
  double lease_s = 10.0;
  int max_subscribers = 32;
  int max_per_address = 4;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("listen", listen, "numeric addresses to serve; beyond loopback, clients echo a cookie");
    v.field("port", port, Bounds{1, 65535}, "UDP port");
    v.field("lease_s", lease_s, Bounds{1, 3600}, "a WATCH not renewed for longer ends");
    v.field("max_subscribers", max_subscribers, Bounds{1, 1024}, "further ones get an ERROR");
    v.field("max_per_address", max_per_address, Bounds{1, 1024}, "of them, at one address");
  }
};

enum class SimScenario : std::uint8_t {
  kTwo,
  kFour,
  kLongRange,
  kAggressive,
  kOccluded,
  kStatic,
};
inline constexpr std::array kSimScenarios{Choice{"two", SimScenario::kTwo},
                                          Choice{"four", SimScenario::kFour},
                                          Choice{"long-range", SimScenario::kLongRange},
                                          Choice{"aggressive", SimScenario::kAggressive},
                                          Choice{"occluded", SimScenario::kOccluded},
                                          Choice{"static", SimScenario::kStatic}};

/// A simulated world instead of devices.
struct SimConfig {
  bool enabled = false;
  SimScenario scenario = SimScenario::kFour;
  int seed = 1;
  double epoch_s = 0.0;
  double clock_offset_s = 0.0;
  double clock_skew_ppm = 0.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("enabled", enabled, "replace all devices by a simulated world");
    v.choice("scenario", scenario, kSimScenarios, "what the robots do");
    v.field("seed", seed, Bounds{0, 2147483647}, "same seed, same world, in every process");
    v.field("epoch_s", epoch_s, Bounds{0, 1e9},
            "the machine's monotonic time at which the world began");
    v.field("clock_offset_s", clock_offset_s, Bounds{-1e6, 1e6},
            "this robot's clock minus world time");
    v.field("clock_skew_ppm", clock_skew_ppm, Bounds{-200, 200},
            "how fast this robot's clock runs");
  }
};

enum class LogLevel : std::uint8_t { kDebug, kInfo, kWarning, kError };
inline constexpr std::array kLogLevels{
    Choice{"debug", LogLevel::kDebug}, Choice{"info", LogLevel::kInfo},
    Choice{"warning", LogLevel::kWarning}, Choice{"error", LogLevel::kError}};

struct LogConfig {
  LogLevel level = LogLevel::kInfo;

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("level", level, kLogLevels, "least severity that is written");
  }
};

/// The whole file.
struct Config {
  RobotConfig robot;
  SwarmConfig swarm;
  std::vector<CameraConfig> cameras;
  ImuConfig imu;
  UwbConfig uwb;
  VisionConfig vision;
  EstimatorConfig estimator;
  GraphConfig graph;
  NetConfig net;
  SubscriptionConfig subscription;
  SimConfig sim;
  LogConfig log;

  template <class Visitor>
  void visit(Visitor& v) {
    v.section("robot", robot, "who this is");
    v.section("swarm", swarm, "who is who; the same on all robots");
    v.list("cameras", cameras, "this robot's cameras");
    v.section("imu", imu, "inertial sensor");
    v.section("uwb", uwb, "ranging module");
    v.section("vision", vision, "spots, tracks and IDs");
    v.section("estimator", estimator, "filters");
    v.section("graph", graph, "pose graph");
    v.section("net", net, "mesh traffic");
    v.section("subscription", subscription, "poses for other programs");
    v.section("sim", sim, "simulated devices");
    v.section("log", log, "messages");
  }
};

}  // namespace crepes
