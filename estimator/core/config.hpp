/// Every setting, once: its key, default, bounds, meaning, and whether a change needs a restart.
/// The groups are in their own headers.
#pragma once

#include <vector>

#include "estimator/core/config_schema.hpp"
#include "estimator/core/estimation_config.hpp"
#include "estimator/core/sensor_config.hpp"
#include "estimator/core/service_config.hpp"
#include "estimator/core/swarm_config.hpp"

namespace crepes {

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
  SimConfig sim;
  LogConfig log;

  template <class Visitor>
  void visit(Visitor& v) {
    v.section("robot", robot, Change::kRestart, "who this is");
    v.section("swarm", swarm, Change::kLive, "who is who; the same on all robots");
    v.list("cameras", cameras, Change::kRestart, "this robot's cameras");
    v.section("imu", imu, Change::kLive, "inertial sensor");
    v.section("uwb", uwb, Change::kLive, "ranging module");
    v.section("vision", vision, Change::kLive, "spots, tracks and IDs");
    v.section("estimator", estimator, Change::kLive, "filters");
    v.section("graph", graph, Change::kLive, "pose graph");
    v.section("net", net, Change::kLive, "mesh traffic");
    v.section("subscription", subscription, Change::kLive, "poses for other programs");
    v.section("recording", recording, Change::kRestart, "measurements for crepesctl record");
    v.section("sim", sim, Change::kRestart, "simulated devices");
    v.section("log", log, Change::kLive, "messages");
  }
};

}  // namespace crepes
