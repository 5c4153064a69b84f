/// Replays a swarm in memory and scores every ordered pair.
#pragma once

#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "daemon/ctl/replay/swarm_replay.hpp"
#include "daemon/ctl/score/pair_score.hpp"
#include "tests/study/pair_sightings.hpp"

namespace crepes::study {

using OrderedPair = std::pair<RobotId, RobotId>;  ///< observer, neighbor
using PairScores = std::map<OrderedPair, PairScore>;

[[nodiscard]] std::vector<OrderedPair> pairs_of(const Swarm& swarm);

/// What else is seen of a replay; each may be empty.
struct ReplayHooks {
  std::function<void(Report&)> on_report{};  ///< may change what robots broadcast
  std::function<void(RobotId observer, const TeamRecord&)> on_team{};
};

/// By the code of `crepesctl replay`, over poses from `after_s` on. The error says which input is
/// wrong.
[[nodiscard]] Result<PairScores> replay_scores(const Swarm& swarm, const ReplayOptions& options,
                                               double after_s, const ReplayHooks& hooks = {});

}  // namespace crepes::study
