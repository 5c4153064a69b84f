#include "config/schema/plausibility.hpp"

#include <fmt/core.h>
#include <net/if.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

namespace crepes {
namespace {

using Doubts = std::vector<RuleFault>;

constexpr double kLongArm = 1.0;    // m; of a lever arm on a robot
constexpr double kFewFrames = 2.0;  // of a slot
constexpr double kLongestSlot_ms = 70.0;
constexpr double kMillisecond = 1e-3;  // s

void doubt_name(const SwarmConfig& swarm, std::size_t i, Doubts& doubts) {
  const MemberConfig& member = swarm.members[i];
  const auto doubt = [&](const char* reason) {
    doubts.push_back({fmt::format("swarm.members[{}].name", i), reason});
  };
  for (const char* taken : {"team", "truth", "null"})
    if (member.name == taken) doubt("means something else in data sets and replays");
  if (std::ranges::any_of(swarm.members, [&](const MemberConfig& other) {
        return other.id != member.id && member.name == std::to_string(other.id.value);
      }))
    doubt("is the id of another robot: tools would take one for the other");
}

void doubt_members(const SwarmConfig& swarm, Doubts& doubts) {
  for (std::size_t i = 0; i < swarm.members.size(); ++i) {
    doubt_name(swarm, i, doubts);
    const MemberConfig& member = swarm.members[i];
    const auto doubt_arm = [&](const char* key, const Eigen::Vector3d& arm, const char* what) {
      const std::string path = fmt::format("swarm.members[{}].{}", i, key);
      if (arm.isZero(0.0))
        doubts.push_back({path, fmt::format("is 0: measure where the {} is", what)});
      if (arm.norm() > kLongArm)
        doubts.push_back({path, fmt::format("is {:.2f} m long: the unit is metres", arm.norm())});
    };
    doubt_arm("p_body_led", member.p_body_led, "center of the LED ring");
    doubt_arm("p_body_uwb", member.p_body_uwb, "UWB antenna");
    if (member.ring_leds && !member.ring_radius_m) {
      doubts.push_back(
          {fmt::format("swarm.members[{}].ring_leds", i), "has no effect without ring_radius_m"});
    }
  }
}

void doubt_cameras(const Config& config, Doubts& doubts) {
  std::error_code status;
  for (std::size_t i = 0; i < config.cameras.size(); ++i) {
    const CameraConfig& camera = config.cameras[i];
    const std::string key = fmt::format("cameras[{}]", i);
    const Pose& T_C_B = camera.calibration.T_cam_imu;
    if (T_C_B.q.isApprox(Eigen::Quaterniond::Identity()) && T_C_B.p.isZero(0.0)) {
      doubts.push_back({key + ".T_cam_imu",
                        "is the identity: the camera would look along the body's z, upwards"});
    }
    if (T_C_B.p.norm() > kLongArm) {
      doubts.push_back({key + ".T_cam_imu",
                        fmt::format("moves by {:.2f} m: the unit is metres", T_C_B.p.norm())});
    }
    const double frames = camera.calibration.rate_hz * config.swarm.slot_ms * kMillisecond;
    if (frames < kFewFrames) {
      doubts.push_back(
          {key + ".rate_hz",
           readable_slot_ms(camera.calibration.rate_hz) > kLongestSlot_ms
               ? fmt::format("is too slow to read codes: {:.0f} frames a second or more",
                             std::ceil(kFewFrames / (kLongestSlot_ms * kMillisecond)))
               : fmt::format("gives {:.1f} frames a slot; two or more can be read "
                             "reliably: swarm.slot_ms: {:.0f}, and the same on the boards",
                             frames, readable_slot_ms(camera.calibration.rate_hz))});
    }
    if (camera.device.driver == CameraDriver::kFolder &&
        !std::filesystem::is_directory(camera.device.folder, status))
      doubts.push_back({key + ".folder", "there is no such folder now"});
  }
}

void doubt_keys(const Config& config, Doubts& doubts) {
  const std::vector<MemberConfig>& members = config.swarm.members;
  const bool has_keys = std::ranges::any_of(
      members, [](const MemberConfig& m) { return m.public_key && !m.excluded; });
  for (std::size_t i = 0; i < members.size(); ++i) {
    const MemberConfig& member = members[i];
    const auto doubt = [&](const char* key, const char* reason) {
      doubts.push_back({fmt::format("swarm.members[{}].{}", i, key), reason});
    };
    const bool is_own = member.id == config.robot.id;
    if (member.excluded && is_own) doubt("excluded", "is this robot: no other reads what it sends");
    if (member.excluded && !has_keys)
      doubt("excluded", "without public_key of the others, it can speak for any of them");
    if (member.public_key || member.excluded) continue;
    if (has_keys) {
      doubt("public_key", "is missing: any robot of the swarm could speak for it");
    } else if (is_own && !config.net.robot_key_file.empty()) {
      doubt("public_key", "is missing: nobody can verify what net.robot_key_file signs");
    }
  }
  if (config.net.interface == "lo") return;
  if (config.net.key_file.empty()) {
    doubts.push_back(
        {"net.key_file", "is empty: whoever is on the mesh can read and forge; crepesctl keygen"});
  } else if (!has_keys && config.net.robot_key_file.empty()) {
    doubts.push_back(
        {"net.robot_key_file",
         "is empty: any robot of the swarm could speak for another; crepesctl keygen"});
  }
}

}  // namespace

double readable_slot_ms(double rate_hz) {
  return std::ceil(kFewFrames / rate_hz / kMillisecond - 1e-6);
}

std::vector<RuleFault> doubtful_settings(const Config& config) {
  Doubts doubts;
  doubt_members(config.swarm, doubts);
  doubt_cameras(config, doubts);
  doubt_keys(config, doubts);
  if (::if_nametoindex(config.net.interface.c_str()) == 0)
    doubts.push_back({"net.interface", "there is no such interface now"});
  return doubts;
}

}  // namespace crepes
