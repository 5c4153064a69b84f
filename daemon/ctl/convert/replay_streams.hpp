/// The topics of a replay: what each robot found out about its neighbors.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/ctl/convert/message_stream.hpp"
#include "daemon/ctl/dataset/replay_pairs.hpp"
#include "daemon/ctl/dataset/truth.hpp"

namespace crepes {

/// The rows of one pair. `observer` and `neighbor` are known with the data set only.
struct ReplayedPair {
  PairName name;
  PairFiles files;
  std::optional<SwarmRobot> observer;
  std::optional<SwarmRobot> neighbor;
};

/// Reads all pairs. With a manifest their times are those of the recording; a robot that it does
/// not list is an error. Without it they are the observer's own, from its first row on, and a
/// replay of several observers is an error: their clocks differ.
[[nodiscard]] Result<std::vector<ReplayedPair>> read_replay(const std::filesystem::path& results,
                                                            const SwarmManifest* manifest);

/// /tf (OBSERVER/NEIGHBOR in OBSERVER), /OBSERVER/NEIGHBOR/pose and .../estimate, and with
/// --debug-innovations .../innovation. `truth` may be null.
[[nodiscard]] std::vector<MessageStream> replay_streams(const std::vector<ReplayedPair>& pairs,
                                                        const SwarmTruth* truth);

}  // namespace crepes
