/// Replays a recorded swarm: every robot runs the daemon's estimation on virtual time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "config/schema/config.hpp"
#include "daemon/ctl/dataset/swarm_dataset.hpp"
#include "daemon/ctl/dataset/truth.hpp"
#include "daemon/ctl/replay/replay_output.hpp"
#include "drivers/dataset/dataset_faults.hpp"
#include "estimator/core/event.hpp"
#include "estimator/core/result.hpp"
#include "net/endpoint.hpp"
#include "net/mesh/packet_seal.hpp"
#include "net/mesh/packet_signature.hpp"

namespace crepes {

/// What passes from a measurement to its arrival in the daemon: exposure, transfer, detection.
struct SensorDelays {
  std::vector<std::string> robots;  ///< by name or id; empty: of all
  double camera_s = 0.0;
  double uwb_s = 0.0;
  double imu_s = 0.0;
};

/// Options of `crepesctl replay`.
struct ReplayOptions {
  std::filesystem::path swarm_dir;
  std::filesystem::path out_dir;
  std::optional<Profile> profile;     ///< overrides the configuration files
  bool graph = true;                  ///< false: no pose graph, even if the files enable it
  bool records = false;               ///< also writes the residual and verdict of every measurement
  std::optional<std::uint64_t> seed;  ///< seed of the network; overrides swarm.yaml
  std::optional<double> loss;         ///< share of lost datagrams; overrides swarm.yaml
  double burst_s = 0.0;               ///< losses of a link come together for so long; 0: one by one
  double reach_m = 0.0;  ///< robots further apart do not hear each other, by truth/; 0: all do
  bool forwards =
      true;  ///< what a robot hears, it forwards to those that do not, as batman-adv does
  bool sealed = false;  ///< datagrams are sealed and signed, with keys for the replay
  SensorDelays delays;
  std::function<void(double)> on_progress;  ///< progress, 0..1, called regularly
};

/// A datagram on its way to one receiver.
struct Delivery {
  double arrives_s = 0.0;  ///< true time
  std::vector<std::uint8_t> bytes;
  Endpoint from{};
};

/// Of a robot in a replay.
[[nodiscard]] Endpoint replay_address(RobotId robot);
/// What a robot has if `ReplayOptions::sealed` is set: the swarm's key, and a key of its own.
[[nodiscard]] MeshKey replay_swarm_key();
[[nodiscard]] RobotKey replay_robot_key(RobotId robot);

/// What was replayed.
struct ReplaySummary {
  std::size_t robots = 0;
  std::uint64_t poses = 0;  ///< rows written
  double duration_s = 0.0;  ///< of the recording
  DatasetFaults faults;
  std::vector<std::string> notes{};  ///< who never had a pose and why, and what robots found faulty
};

/// No threads, one queue in the order of true time: the same input and seed give the same poses to
/// the last bit. The robots see only their own clocks.
[[nodiscard]] Result<ReplaySummary> replay_swarm(const ReplayOptions& options);

/// The receivers of the robots' outputs.
struct ReplaySinks {
  std::function<void(RobotId observer, const NeighborPose&)> on_pose;
  std::function<void(RobotId observer, const Records&)> on_records;  ///< empty: none are kept
  /// May change, add or remove deliveries of a datagram, for studies of bad networks; may be empty.
  std::function<void(RobotId from, RobotId to, double sent_s, std::vector<Delivery>&)> on_delivery;
  /// May change a reading of a robot's own sensor before it is used, and false removes it. Its
  /// stamp is that of the recording. May be empty.
  std::function<bool(RobotId robot, double true_s, Event&)> on_reading;
  /// May change a report before it is sent, for studies of faulty members; may be empty.
  std::function<void(Report&)> on_report;
};

/// The same from memory; the directories in `options` are not used. `truth` counts wrong IDs for
/// the report; no estimator receives it. A picture that cannot be read is an error.
[[nodiscard]] Result<ReplayReport> replay_dataset(SwarmDataset dataset,
                                                  const std::optional<SwarmTruth>& truth,
                                                  const ReplayOptions& options,
                                                  const ReplaySinks& sinks);

}  // namespace crepes
