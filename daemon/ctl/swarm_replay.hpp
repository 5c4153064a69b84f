/// A recorded swarm lived through again: every robot runs what the daemon runs, on virtual time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>

#include "daemon/ctl/dataset_faults.hpp"
#include "daemon/ctl/replay_output.hpp"
#include "daemon/ctl/swarm_dataset.hpp"
#include "daemon/ctl/truth.hpp"
#include "estimator/core/config.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

struct ReplayOptions {
  std::filesystem::path swarm_dir;
  std::filesystem::path out_dir;
  std::optional<Profile> profile;           ///< instead of what the configuration files say
  bool graph = true;                        ///< false: no pose graph, whatever the files say
  bool records = false;                     ///< also every measurement's residual and verdict
  std::optional<std::uint64_t> seed;        ///< of the network, instead of swarm.yaml's
  std::function<void(double)> on_progress;  ///< share done, 0..1, now and then
};

struct ReplaySummary {
  std::size_t robots = 0;
  std::uint64_t poses = 0;  ///< rows written
  double duration_s = 0.0;  ///< of the recording
  DatasetFaults faults;
};

/// No threads, one queue in order of true time: same input and seed, same poses to the last bit.
/// True time orders what reaches the robots; they see only their own clocks.
[[nodiscard]] Result<ReplaySummary> replay_swarm(const ReplayOptions& options);

/// Who takes what robots say.
struct ReplaySinks {
  std::function<void(RobotId observer, const NeighborPose&)> on_pose;
  std::function<void(RobotId observer, const Records&)> on_records;  ///< empty: none are kept
};

/// The same from memory; the directories of `options` are not used. `truth` judges IDs for the
/// report, no estimator sees it. The error of a picture that cannot be read.
[[nodiscard]] Result<ReplayReport> replay_dataset(SwarmDataset dataset,
                                                  const std::optional<SwarmTruth>& truth,
                                                  const ReplayOptions& options,
                                                  const ReplaySinks& sinks);

}  // namespace crepes
