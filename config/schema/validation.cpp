#include "config/schema/validation.hpp"

#include <fmt/core.h>
#include <net/if.h>
#include <sys/un.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <set>
#include <utility>

#include "estimator/vision/camera_model.hpp"
#include "estimator/vision/id_library.hpp"
#include "net/endpoint.hpp"
#include "net/mesh/packet_signature.hpp"

namespace crepes {
namespace {

using RuleFaults = std::vector<RuleFault>;

constexpr std::size_t kMaxCameras = 16;
constexpr std::size_t kMaxPush = 8;

std::string item(const std::string& list, std::size_t i) { return fmt::format("{}[{}]", list, i); }

/// Names appear in file names and in datagrams.
bool is_plain_name(const std::string& name) {
  constexpr std::size_t kMaxLength = 32;
  const auto is_plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
  };
  return !name.empty() && name.size() <= kMaxLength && std::ranges::all_of(name, is_plain);
}

void check_name(const std::string& key, const std::string& name, RuleFaults& faults) {
  if (!is_plain_name(name)) {
    faults.push_back(
        {key, fmt::format("a name is 1 to 32 letters, digits, - or _, not \"{}\"", name)});
  }
}

/// Reports each element whose value an earlier element already has. Empty values are not compared.
template <class T, class ValueOf>
void check_unique(const std::string& list, const std::string& key, const std::vector<T>& items,
                  const ValueOf& value_of, RuleFaults& faults) {
  std::map<std::string, std::size_t> first;
  for (std::size_t i = 0; i < items.size(); ++i) {
    const std::string& value = value_of(items[i]);
    if (value.empty()) continue;
    const auto [it, inserted] = first.emplace(value, i);
    if (!inserted) {
      faults.push_back(
          {item(list, i) + key, fmt::format("{} is taken by {}", value, item(list, it->second))});
    }
  }
}

std::string pattern_fault(const std::string& pattern) {
  if (pattern.find_first_not_of("01") != std::string::npos)
    return fmt::format("a pattern is made of 0 and 1 only, not \"{}\"", pattern);
  if (pattern.size() < BlinkCode::kMinSlots || pattern.size() > BlinkCode::kMaxSlots)
    return fmt::format("a pattern has 8 to 32 slots, not {}", pattern.size());
  if (pattern.find('0') == std::string::npos || pattern.find('1') == std::string::npos)
    return "a pattern has both lit and dark slots";
  return "";
}

/// Both members must be free of faults.
std::string code_conflict(const MemberConfig& a, const MemberConfig& b, const SwarmConfig& swarm) {
  if (!blink_alike(a, b, swarm)) return "";
  if (a.pattern && b.pattern) return "the same pattern, shifted, as that of ";
  return a.pattern ? "within 0.02 of the pattern of " : "within 0.02 of the duty of ";
}

void check_codes(const SwarmConfig& swarm, RuleFaults& faults) {
  const std::vector<MemberConfig>& members = swarm.members;
  std::vector<bool> sound(members.size(), true);
  for (std::size_t i = 0; i < members.size(); ++i) {
    const MemberConfig& member = members[i];
    const std::string key = item("swarm.members", i);
    const std::size_t before = faults.size();
    if (member.pattern.has_value() == member.duty.has_value())
      faults.push_back({key, "give exactly one of pattern and duty"});
    if (member.pattern) {
      const std::string reason = pattern_fault(*member.pattern);
      if (!reason.empty()) faults.push_back({key + ".pattern", reason});
    }
    sound[i] = faults.size() == before;
    for (std::size_t j = 0; sound[i] && j < i; ++j) {
      const std::string conflict = sound[j] ? code_conflict(members[j], member, swarm) : "";
      if (conflict.empty()) continue;
      faults.push_back({key + (member.pattern ? ".pattern" : ".duty"),
                        fmt::format("{}{}: no camera can tell the two apart", conflict,
                                    item("swarm.members", j))});
      break;
    }
  }
}

void check_members(const Config& config, RuleFaults& faults) {
  const std::vector<MemberConfig>& members = config.swarm.members;
  if (members.empty())
    faults.push_back({"swarm.members", "is empty: list every robot, this one too"});
  for (std::size_t i = 0; i < members.size(); ++i)
    check_name(item("swarm.members", i) + ".name", members[i].name, faults);

  const auto id_text = [](int id) { return id == 0 ? std::string() : std::to_string(id); };
  check_unique(
      "swarm.members", ".id", members, [&](const MemberConfig& m) { return id_text(m.id.value); },
      faults);
  check_unique("swarm.members", ".name", members, std::mem_fn(&MemberConfig::name), faults);
  check_unique(
      "swarm.members", ".uwb_id", members,
      [&](const MemberConfig& m) {
        return m.uwb_id ? std::to_string(*m.uwb_id) : id_text(m.id.value);
      },
      faults);
  check_codes(config.swarm, faults);

  const auto has_member = [&](RobotId id) {
    return std::ranges::count(members, id, &MemberConfig::id) > 0;
  };
  const bool all_read = config.robot.id != RobotId{} && !members.empty() && !has_member(RobotId{});
  if (all_read && !has_member(config.robot.id)) {
    faults.push_back(
        {"robot.id", fmt::format("{} is not among swarm.members", config.robot.id.value)});
  }
}

void check_keys(const Config& config, RuleFaults& faults) {
  const std::vector<MemberConfig>& members = config.swarm.members;
  for (std::size_t i = 0; i < members.size(); ++i) {
    const MemberConfig& member = members[i];
    if (!member.public_key) continue;
    if (!parse_public_key(*member.public_key)) {
      faults.push_back({item("swarm.members", i) + ".public_key",
                        fmt::format("expected a public key as crepesctl keygen prints it, found "
                                    "\"{}\"",
                                    *member.public_key)});
    }
    if (member.id == config.robot.id && config.net.robot_key_file.empty()) {
      faults.push_back({"net.robot_key_file",
                        fmt::format("is empty, and {} has a public_key: nobody would believe this "
                                    "robot",
                                    item("swarm.members", i))});
    }
  }
  check_unique(
      "swarm.members", ".public_key", members,
      [](const MemberConfig& m) { return m.public_key.value_or(""); }, faults);
}

constexpr double kMostArm = 5.0;  // m, as of the members' lever arms

void check_driver(const std::string& key, const CameraConfig& camera, RuleFaults& faults) {
  constexpr double kMicroseconds = 1e6;
  if (camera.device.driver == CameraDriver::kFolder && camera.device.folder.empty())
    faults.push_back({key + ".folder", "driver folder needs the directory of the pictures"});
  if (camera.device.driver == CameraDriver::kV4l2 && camera.device.id.empty())
    faults.push_back({key + ".device", "driver v4l2 needs one, as /dev/video0"});
  if (camera.device.light.exposure_us &&
      *camera.device.light.exposure_us >= kMicroseconds / camera.calibration.rate_hz)
    faults.push_back({key + ".exposure_us", "is longer than a frame at rate_hz"});
  if (camera.device.exposure == ExposureControl::kAuto && !camera.device.light.exposure_us)
    faults.push_back({key + ".exposure", "auto needs exposure_us, the longest exposure"});
  const bool is_kernels = camera.device.driver == CameraDriver::kV4l2 ||
                          camera.device.driver == CameraDriver::kLibcamera;
  if (is_kernels && camera.device.trigger == CameraTrigger::kHardware)
    faults.push_back({key + ".trigger", "drivers v4l2 and libcamera set no hardware trigger"});
  if (camera.device.driver == CameraDriver::kLibcamera && camera.device.offset != std::array{0, 0})
    faults.push_back({key + ".offset", "driver libcamera reads out the whole sensor"});
  if (camera.device.driver != CameraDriver::kMindVision) return;
  if (camera.device.light.gain) faults.push_back({key + ".gain", "driver mindvision sets none"});
  if (camera.device.offset != std::array{0, 0})
    faults.push_back({key + ".offset", "driver mindvision reads out the whole sensor"});
}

void check_rows(const std::string& key, const CameraCalibration& camera, RuleFaults& faults) {
  const double readout_s =
      1e-6 * std::abs(camera.rolling_shutter_us_per_row) * camera.resolution[1];
  if (readout_s > 1.0 / camera.rate_hz) {
    faults.push_back({key + ".rolling_shutter_us_per_row",
                      "all rows together take longer than a frame at rate_hz"});
  }
}

void check_cameras(const std::vector<CameraConfig>& cameras, RuleFaults& faults) {
  if (cameras.empty())
    faults.push_back({"cameras", "is empty: without a camera nobody is recognized"});
  if (cameras.size() > kMaxCameras) faults.push_back({"cameras", "more than 16"});
  check_unique(
      "cameras", ".name", cameras,
      [](const CameraConfig& camera) { return camera.calibration.name; }, faults);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const std::string key = item("cameras", i);
    check_name(key + ".name", cameras[i].calibration.name, faults);
    for (CalibrationFault& fault : calibration_faults(cameras[i].calibration))
      faults.push_back({fmt::format("{}.{}", key, fault.key), std::move(fault.reason)});
    const Eigen::Vector3d& arm = cameras[i].calibration.T_cam_imu.p;
    if (!(arm.cwiseAbs().maxCoeff() <= kMostArm))
      faults.push_back({key + ".T_cam_imu", "moves by more than 5 m: the unit is metres"});
    check_rows(key, cameras[i].calibration, faults);
    check_driver(key, cameras[i], faults);
  }
}

void check_imu(const ImuDeviceConfig& imu, RuleFaults& faults) {
  constexpr double kLeastVolume = 0.1;  // of the box that T makes of a unit cube
  if (!imu.T_body_imu.p.isZero(0.0))
    faults.push_back({"imu.T_body_imu", "the body's origin is the IMU: the last column must be 0"});
  const auto check_triad = [&](const std::string& key, const TriadConfig& triad, double most) {
    if (!(triad.bias.cwiseAbs().maxCoeff() <= most))
      faults.push_back({key + ".bias", fmt::format("no sensor is off by more than {}", most)});
    if (triad.misalignment.determinant() >= kLeastVolume) return;
    faults.push_back({key + ".misalignment", "mirrors or flattens: its determinant is below 0.1"});
  };
  constexpr double kMostAccelBias = 20.0;  // m/s^2
  constexpr double kMostGyroBias = 2.0;    // rad/s
  check_triad("imu.accelerometer", imu.accelerometer, kMostAccelBias);
  check_triad("imu.gyroscope", imu.gyroscope, kMostGyroBias);
}

/// Bytes that the kernel takes for a name; the last one ends it.
bool is_name_of_at_most(std::size_t bytes, const std::string& name) {
  return name.size() < bytes && name.find('\0') == std::string::npos;
}

void check_ports(const Config& config, RuleFaults& faults) {
  if (!config.imu.device.port.empty() && config.imu.device.port == config.uwb.device.port)
    faults.push_back({"uwb.port", "is imu.port: each needs a line of its own"});
  if (!is_name_of_at_most(sizeof(sockaddr_un::sun_path), config.recording.socket))
    faults.push_back({"recording.socket", "a socket's path has at most 107 bytes, none of them 0"});
}

void check_listen(const std::vector<std::string>& listen, RuleFaults& faults) {
  std::set<Endpoint> known;
  for (const std::string& address : listen) {
    const auto endpoint = Endpoint::parse(address, 1);
    const bool is_any = address == "0.0.0.0" || address == "::";
    const std::string any = endpoint && endpoint->is_ipv4() ? "0.0.0.0" : "::";
    const auto refuse = [&](const std::string& reason) {
      faults.push_back({"subscription.listen", fmt::format("\"{}\" {}", address, reason)});
    };
    if (!endpoint) {
      refuse("is not a numeric IPv4 or IPv6 address");
    } else if (!is_any && !endpoint->is_unicast()) {
      refuse("is no host's address");
    } else if (!known.insert(*endpoint).second) {
      refuse("is listed twice");
    } else if (!is_any && std::ranges::count(listen, any) > 0) {
      refuse(fmt::format("is contained in \"{}\": name one of them", any));
    }
  }
}

void check_push(const std::string& key, const PushConfig& push, const Config& config,
                RuleFaults& faults) {
  const auto target = Endpoint::parse(push.address, static_cast<std::uint16_t>(push.port));
  if (!target || !target->is_unicast()) {
    return faults.push_back(
        {key + ".address",
         fmt::format("\"{}\" is not one host's numeric IPv4 or IPv6 address", push.address)});
  }
  if (target->is_loopback() &&
      (push.port == config.subscription.port || push.port == config.net.port))
    faults.push_back({key + ".port", "is the daemon's own"});
}

void check_network(const Config& config, RuleFaults& faults) {
  if (config.net.port == config.subscription.port)
    faults.push_back({"subscription.port", "is taken by net.port"});
  const std::string& interface = config.net.interface;
  if (interface.empty() || !is_name_of_at_most(IF_NAMESIZE, interface) ||
      interface.find_first_of("/ \t\n") != std::string::npos)
    faults.push_back({"net.interface", "an interface's name has 1 to 15 letters, no / or space"});
  check_listen(config.subscription.listen, faults);
  const std::vector<PushConfig>& push = config.subscription.push;
  if (push.size() > kMaxPush) faults.push_back({"subscription.push", "more than 8"});
  for (std::size_t i = 0; i < push.size(); ++i)
    check_push(item("subscription.push", i), push[i], config, faults);
}

}  // namespace

std::vector<RuleFault> validate(const Config& config) {
  RuleFaults faults;
  check_members(config, faults);
  check_keys(config, faults);
  check_cameras(config.cameras, faults);
  check_imu(config.imu.device, faults);
  check_network(config, faults);
  check_ports(config, faults);
  if (config.vision.min_area_px2 >= config.vision.max_area_px2)
    faults.push_back({"vision.max_area_px2", "must be above min_area_px2"});
  return faults;
}

}  // namespace crepes
