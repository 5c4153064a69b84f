#include "daemon/ctl/setup/robot_plan.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <string_view>

#include "config/schema/plausibility.hpp"
#include "config/writing/config_writer.hpp"
#include "estimator/calibration/camera/camera_start.hpp"
#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

Eigen::Vector3d optical_axis(Look look) {
  switch (look) {
    case Look::kBackward:
      return -Eigen::Vector3d::UnitX();
    case Look::kLeft:
      return Eigen::Vector3d::UnitY();
    case Look::kRight:
      return -Eigen::Vector3d::UnitY();
    case Look::kUp:
      return Eigen::Vector3d::UnitZ();
    case Look::kDown:
      return -Eigen::Vector3d::UnitZ();
    default:
      return Eigen::Vector3d::UnitX();
  }
}

const MemberConfig& own_member(const RobotPlan& plan) {
  const auto own = std::ranges::find(plan.members, plan.id, &MemberConfig::id);
  return own == plan.members.end() ? plan.members.front() : *own;
}

std::string arm_cell(const Eigen::Vector3d& arm, Eigen::Index axis) {
  return arm.isZero(0.0) ? "______" : fmt::format("{:6.3f}", arm[axis]);
}

std::string arm_row(std::string_view what, const Eigen::Vector3d& arm, std::string_view key) {
  return fmt::format("  {:<24}  {}     {}     {}   {}\n", what, arm_cell(arm, 0), arm_cell(arm, 1),
                     arm_cell(arm, 2), key);
}

std::string serial_text(std::string_view section, const PlannedSerial& line) {
  if (line.port.empty())
    return fmt::format("# {}: {{port: \"\"}}   # not found; see `crepesctl devices`\n", section);
  std::string text = fmt::format("{}:\n  port: {}\n", section, to_yaml(line.port));
  if (line.baud > 0) text += fmt::format("  baud: {}\n", line.baud);
  return text + fmt::format("  protocol: {}\n", line.protocol);
}

constexpr std::string_view kDrawing = R"(
            z, up
            |    x, forward
            |   /
            |  /                 Origin: the inertial sensor's chip.
            | /                  Measure from there, in meters,
  y, left --O                    along the robot's own axes.
)";

}  // namespace

Eigen::Matrix3d R_camera_body(Look look) {
  const Eigen::Vector3d z = optical_axis(look);
  const bool is_level = z.z() == 0.0;
  const Eigen::Vector3d y = is_level ? Eigen::Vector3d(-Eigen::Vector3d::UnitZ())
                                     : Eigen::Vector3d(-Eigen::Vector3d::UnitX());
  Eigen::Matrix3d R_C_B;
  R_C_B << y.cross(z).transpose(), y.transpose(), z.transpose();
  return R_C_B;
}

std::string robot_file(const RobotPlan& plan) {
  return fmt::format(
      "# Robot {0}, written by crepesctl init. What is connected: crepesd.d/10-devices.yaml.\n"
      "# Everything that is not here has its default: crepesd.yaml(5).\n"
      "robot: {{id: {0}}}\n"
      "swarm: {{members_file: swarm.yaml}}          # the same file on all robots\n"
      "cameras:\n"
      "  - name: cam0\n"
      "    calibration: camchain-imucam.yaml     # a guess, until `crepesctl calibrate camera`\n"
      "    rate_hz: {1}\n"
      "uwb:\n"
      "  noise_m: 0.1                            # between robots that turn\n"
      "  bias_sigma_m: 0.2                       # until `crepesctl calibrate range`\n"
      "  bias_drift_m: 0.06                      # with the antennas' direction, in bias_time_s\n"
      "  bias_time_s: 2\n"
      "net: {{interface: {2}}}\n",
      plan.id.value, to_yaml(plan.camera.rate_hz), plan.interface);
}

std::string devices_file(const RobotPlan& plan) {
  std::string text =
      "# What is connected, as `crepesctl devices` found it. Written by crepesctl init.\n";
  text += fmt::format("cameras:\n  - name: cam0\n    driver: {}\n", plan.camera.driver);
  if (!plan.camera.device.empty())
    text += fmt::format("    device: {}\n", to_yaml(plan.camera.device));
  if (plan.camera.driver == "aravis" || plan.camera.driver == "mindvision")
    text += "    exposure_us: 500   # then `crepesctl exposure`\n";
  return text + serial_text("imu", plan.imu) + serial_text("uwb", plan.uwb);
}

/// Empty where the camera is fast enough for the default.
std::string slot_text(double rate_hz) {
  constexpr double kLongestSlot = 70.0;  // ms; a slower camera is warned of
  const double slot_ms = std::min(readable_slot_ms(rate_hz), kLongestSlot);
  if (slot_ms <= SwarmConfig{}.slot_ms) return "";
  return fmt::format("  slot_ms: {}   # two frames of the slowest camera; boards are set by it\n",
                     to_yaml(slot_ms));
}

std::string members_file(const RobotPlan& plan) {
  std::string text =
      "# The members of the swarm, written by crepesctl init: the same file on all robots.\n"
      "# p_body_led and p_body_uwb: LED ring's center and UWB antenna, from the inertial sensor.\n"
      "swarm:\n" +
      slot_text(plan.camera.rate_hz) + "  members:\n";
  for (const MemberConfig& member : plan.members) {
    text +=
        fmt::format("    - {{id: {}, name: {}, pattern: \"{}\", p_body_led: {}, p_body_uwb: {}}}\n",
                    member.id.value, member.name, member.pattern.value_or(""),
                    to_yaml(member.p_body_led), to_yaml(member.p_body_uwb));
  }
  return text;
}

std::string lens_file(const RobotPlan& plan) {
  const PlannedCamera& camera = plan.camera;
  const LensVector lens =
      generic_lens(camera.resolution[0], camera.resolution[1], radians(camera.fov_deg));
  const Eigen::Matrix3d R = R_camera_body(camera.look).array() + 0.0;  // no -0
  const Eigen::Vector3d p = -(R * own_member(plan).p_body_led);
  std::string text = fmt::format(
      "# A guess by crepesctl init: a generic lens of {} deg. `crepesctl calibrate camera` writes\n"
      "# the true one in its place; until then no pose comes from this camera.\n"
      "cam0:\n"
      "  calibrated: false\n"
      "  camera_model: ds\n"
      "  intrinsics: {}\n"
      "  distortion_model: none\n"
      "  distortion_coeffs: []\n"
      "  resolution: {}\n"
      "  T_cam_imu:\n",
      to_yaml(camera.fov_deg), to_yaml(std::vector<double>(lens.begin(), lens.end())),
      to_yaml(camera.resolution));
  for (int row = 0; row < 3; ++row) {
    text += fmt::format(
        "  - {}\n", to_yaml(std::vector<double>{R(row, 0), R(row, 1), R(row, 2), p[row] + 0.0}));
  }
  return text + "  - [0.0, 0.0, 0.0, 1.0]\n  timeshift_cam_imu: 0.0\n";
}

std::string measuring_sheet(const RobotPlan& plan) {
  std::string text = "Measure on every robot, and write into swarm.yaml:\n";
  text += kDrawing;
  text += "\n                              x fwd [m]  y left [m]  z up [m]\n";
  for (const MemberConfig& member : plan.members) {
    text += fmt::format("robot {} ({})\n", member.id.value, member.name);
    text += arm_row("center of the LED ring", member.p_body_led, "p_body_led");
    text += arm_row("UWB antenna", member.p_body_uwb, "p_body_uwb");
  }
  return text +
         "\nTo the left is positive y, to the right negative. 5 mm are good enough. The camera "
         "need\n"
         "not be measured: `crepesctl calibrate camera` finds it.\n";
}

}  // namespace crepes
