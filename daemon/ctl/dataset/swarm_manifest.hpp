/// swarm.yaml: the robots of a recording, and how it was made.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "drivers/dataset/robot_clock.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// A packet reaches each receiver after latency + U(0, jitter), or is lost with probability `loss`.
struct NetworkModel {
  double latency_ms = 0.0;
  double jitter_ms = 0.0;
  double loss = 0.0;
  std::uint64_t seed = 0;
};

/// A robot as swarm.yaml lists it.
struct SwarmRobot {
  RobotId id{};
  std::string name;
  std::filesystem::path dir;  ///< relative to the data set
  RobotClock clock;
};

/// Whether a user means this robot: by its name or its id.
[[nodiscard]] bool is_named(const SwarmRobot& robot, const std::string& name_or_id);

/// swarm.yaml.
struct SwarmManifest {
  std::string scenario;
  double duration_s = 0.0;
  NetworkModel network;
  std::vector<SwarmRobot> robots;
};

/// The text of swarm.yaml, and of one robot's line in it.
[[nodiscard]] std::string manifest_text(const SwarmManifest& manifest);
[[nodiscard]] std::string robot_text(const SwarmRobot& robot);

/// Reads and checks DIR/swarm.yaml; an error names file, line and key.
[[nodiscard]] Result<SwarmManifest> load_manifest(const std::filesystem::path& dir);

}  // namespace crepes
