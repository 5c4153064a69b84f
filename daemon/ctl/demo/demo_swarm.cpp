#include "daemon/ctl/demo/demo_swarm.hpp"

#include <fmt/core.h>

#include <array>
#include <string>

#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

/// Cyclic codes that differ from each other at every phase.
constexpr std::array kPatterns{"011111111111111111", "001001011111111111", "001010101111111111",
                               "001011110011111111", "001011111101011111"};

MemberConfig member(RobotId id, const std::string& pattern) {
  MemberConfig member;
  member.id = id;
  member.name = fmt::format("r{}", id.value);
  member.pattern = pattern;
  member.p_body_led = {0.05, 0.0, 0.01};
  member.p_body_uwb = {-0.04, 0.02, 0.1};
  return member;
}

/// A fisheye camera that looks forward.
CameraConfig camera() {
  CameraConfig camera;
  camera.calibration.name = "cam0";
  camera.calibration.intrinsics = {-0.1723, 0.5931, 316.6, 316.5, 638.4, 512.6};
  camera.calibration.resolution = {1280, 1024};
  Eigen::Matrix3d R_C_B;
  R_C_B << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  camera.calibration.T_cam_imu = {{0.0, 0.01, -0.06}, Eigen::Quaterniond(R_C_B)};
  return camera;
}

/// Clocks of robots that were switched on at different times and are not synchronized.
RobotClock clock_of(std::size_t index) {
  constexpr std::array kOffsets{1017.938, 983.313, 1007.626, 999.097, 1031.442};
  constexpr std::array kSkews{-14.1, 23.6, -11.6, 2.1, 18.3};
  return {kOffsets.at(index), kSkews.at(index)};
}

}  // namespace

std::vector<DemoRobot> demo_swarm(const SimConfig& world, const std::vector<RobotId>& ids,
                                  double epoch_s, std::uint16_t first_port,
                                  std::uint16_t mesh_port) {
  CREPES_EXPECT(ids.size() <= kPatterns.size(), "more robots than patterns");
  SwarmConfig swarm;
  for (std::size_t i = 0; i < ids.size(); ++i)
    swarm.members.push_back(member(ids[i], kPatterns.at(i)));
  std::vector<DemoRobot> robots;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    DemoRobot robot;
    robot.clock = clock_of(i);
    robot.config.robot.id = ids[i];
    robot.config.swarm = swarm;
    robot.config.cameras = {camera()};
    robot.config.net.interface = "lo";
    robot.config.net.port = mesh_port;
    robot.config.subscription.listen = {"127.0.0.1"};
    robot.config.subscription.port = first_port + static_cast<int>(i);
    robot.config.recording.socket.clear();
    robot.config.sim = world;
    robot.config.sim.enabled = true;
    robot.config.sim.epoch_s = epoch_s;
    robot.config.sim.clock_offset_s = robot.clock.offset_s;
    robot.config.sim.clock_skew_ppm = robot.clock.skew_ppm;
    robots.push_back(std::move(robot));
  }
  return robots;
}

}  // namespace crepes
