/// Every setting once: key, default, bounds, meaning, and whether a change needs a restart. Each
/// group is declared by the folder that uses it.
#pragma once

#include <cstdint>
#include <vector>

#include "config/schema/service_config.hpp"
#include "drivers/camera/camera_config.hpp"
#include "drivers/imu/imu_config.hpp"
#include "drivers/sim/sim_config.hpp"
#include "drivers/uwb/uwb_config.hpp"
#include "estimator/core/swarm_config.hpp"
#include "estimator/graph/graph_config.hpp"
#include "estimator/swarm/estimator_config.hpp"
#include "estimator/vision/vision_config.hpp"
#include "net/mesh/mesh_config.hpp"
#include "net/subscription/subscription_config.hpp"

namespace crepes {

/// When a change of a section takes effect. `Config::visit` marks every section of the file.
enum class Change : std::uint8_t {
  kLive,     ///< by a reload (SIGHUP), while the daemon runs
  kRestart,  ///< when the daemon starts again
};

/// Which robot this is.
struct RobotConfig {
  RobotId id{};

  [[nodiscard]] bool operator==(const RobotConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.required("id", id, Bounds{1, 65534}, "this robot's id; must be one of swarm.members");
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
  RecordingConfig recording;
  ViewConfig view;
  SimConfig sim;
  LogConfig log;

  [[nodiscard]] bool operator==(const Config&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.section("robot", robot, Change::kRestart, "this robot");
    v.section("swarm", swarm, Change::kLive, "members of the swarm; the same on all robots");
    v.list("cameras", cameras, Change::kRestart,
           "this robot's cameras; exposure, exposure_us and gain are live");
    v.section("imu", imu, Change::kLive, "inertial sensor");
    v.section("uwb", uwb, Change::kLive, "ranging module");
    v.section("vision", vision, Change::kLive, "spots, tracks and IDs");
    v.section("estimator", estimator, Change::kLive, "filters");
    v.section("graph", graph, Change::kLive, "pose graph");
    v.section("net", net, Change::kLive, "mesh");
    v.section("subscription", subscription, Change::kLive, "poses for other programs");
    v.section("recording", recording, Change::kRestart, "measurements for crepesctl record");
    v.section("view", view, Change::kLive, "the page of crepesctl view");
    v.section("sim", sim, Change::kRestart, "simulated devices");
    v.section("log", log, Change::kLive, "log messages");
  }
};

}  // namespace crepes
