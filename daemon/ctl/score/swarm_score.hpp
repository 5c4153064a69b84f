/// Scores a whole replay: every ordered pair, and the clocks.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "daemon/ctl/dataset/swarm_manifest.hpp"
#include "daemon/ctl/dataset/truth.hpp"
#include "daemon/ctl/score/pair_score.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// A pair of robots and its score.
struct ScoredPair {
  SwarmRobot observer;
  SwarmRobot neighbor;
  std::vector<NeighborPose> poses;
  PairScore score;
};

/// The error of `observer`'s estimate of a peer's clock offset.
struct ClockScore {
  RobotId observer{};
  RobotId peer{};
  std::size_t samples = 0;
  double max_error_s = 0.0;
};

struct SwarmScore {
  std::vector<ScoredPair> pairs;
  std::vector<ClockScore> clocks;  ///< empty without a report
};

/// Reads DIR/<observer>/<neighbor>.csv of every ordered pair and DIR/report.json, and scores the
/// rows after `after_s`. A pair without a file has no poses; no file at all is an error,
/// and so is a report of another recording.
/// `on_progress` receives the share of the pairs that is done.
[[nodiscard]] Result<SwarmScore> score_swarm(const std::filesystem::path& results,
                                             const SwarmManifest& manifest, const SwarmTruth& truth,
                                             double after_s,
                                             const std::function<void(double)>& on_progress = {});

/// Scores both again over their common stamps, pair by pair. Availability remains that of all rows.
void score_common_rows(SwarmScore& a, SwarmScore& b, const SwarmManifest& manifest,
                       const SwarmTruth& truth, double after_s);

}  // namespace crepes
