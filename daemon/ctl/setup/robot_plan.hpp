/// What a new robot's configuration is made of, and the files that it becomes.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "config/schema/config.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Where a camera looks, in the body's axes.
enum class Look : std::uint8_t { kForward, kBackward, kLeft, kRight, kUp, kDown };
inline constexpr std::array kLooks{
    Choice{"forward", Look::kForward}, Choice{"backward", Look::kBackward},
    Choice{"left", Look::kLeft},       Choice{"right", Look::kRight},
    Choice{"up", Look::kUp},           Choice{"down", Look::kDown}};

/// The rotation of a camera that looks there. The top of its picture is up; of a camera that looks
/// up or down, forward.
[[nodiscard]] Eigen::Matrix3d R_camera_body(Look look);

/// The camera of a new robot.
struct PlannedCamera {
  std::string driver = "none";
  std::string device;  ///< empty: the only one
  std::array<int, 2> resolution{1280, 1024};
  double rate_hz = 200.0;
  double fov_deg = 185.0;  ///< rough field of view of the lens
  Look look = Look::kForward;
};

/// A serial sensor of a new robot.
struct PlannedSerial {
  std::string port;
  int baud = 0;  ///< 0: the default
  std::string protocol = "auto";
};

struct RobotPlan {
  RobotId id{};
  std::vector<MemberConfig> members;
  PlannedCamera camera;
  PlannedSerial imu;
  PlannedSerial uwb;
  std::string interface = "bat0";
};

/// The robot itself, with references to the other files.
[[nodiscard]] std::string robot_file(const RobotPlan& plan);
/// A fragment: what is connected.
[[nodiscard]] std::string devices_file(const RobotPlan& plan);
/// The members, the same for all robots.
[[nodiscard]] std::string members_file(const RobotPlan& plan);
/// Kalibr's camchain with a generic lens, marked as not calibrated. The camera is taken to be at
/// the center of the LED ring.
[[nodiscard]] std::string lens_file(const RobotPlan& plan);

/// A drawing of the body's axes, and what to measure, with room to write. For paper.
[[nodiscard]] std::string measuring_sheet(const RobotPlan& plan);

}  // namespace crepes
