/// How near to the bound of the team its robots come, and how honest they are.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tests/study/liar.hpp"
#include "tests/study/replay_scores.hpp"
#include "tests/study/team_bound.hpp"

namespace crepes::study {

/// Of the poses of a set of ordered pairs.
struct TeamQuality {
  double position_rmse_m = 0.0;
  double rotation_rmse_rad = 0.0;
  double median_nees = 0.0;
  double worst_availability = 1.0;
  std::size_t divergences = 0;
  GrossErrorsByMode gross_errors;
};
[[nodiscard]] TeamQuality quality_of(const PairScores& scores);

/// One swarm, what is possible, and what was reached.
struct TeamTrial {
  std::string name;
  PairBound bound;         ///< pooled over all ordered pairs
  PairBound scaled_bound;  ///< with the scale and axis errors of the IMUs; zero if not asked for
  TeamQuality reached;
};

struct TeamTrialOptions {
  SensorPriors priors;
  bool scaled = false;  ///< also the bound with scale errors
  double after_s = 5.0;
  std::optional<TeamMethod> method;  ///< of all robots, instead of the configured one
  ReplayOptions replay;
};

[[nodiscard]] Result<TeamTrial> run_team_trial(const Swarm& swarm, const TeamTrialOptions& options);

/// What the honest robots said about the liar.
struct Naming {
  std::size_t observers = 0;         ///< that are honest
  std::size_t named_by = 0;          ///< of these
  double slowest_s = 0.0;            ///< from the recording's beginning, when the fault begins
  double slowest_since_met_s = 0.0;  ///< from when its sensors were first estimated
  std::size_t false_names = 0;       ///< honest robots that an honest one named, each counted once
};

/// The honest pairs of one swarm with a liar among them, with the same robot honest, and alone.
struct LiarTrial {
  std::string name;
  TeamQuality without;
  TeamQuality with;
  TeamQuality alone;
  Naming naming;
};

/// The robot of the highest id lies; poses of it and by it do not count.
[[nodiscard]] Result<LiarTrial> run_liar_trial(const Swarm& swarm, const Liar& liar,
                                               const TeamTrialOptions& options);

/// A row for each trial, then all together (root mean squares of errors, bounds and ratios; median
/// of medians; pooled shares; longest run), and the lowest, median and highest of each column.
[[nodiscard]] std::string table_of(const std::vector<TeamTrial>& trials);
[[nodiscard]] std::string table_of(const std::vector<LiarTrial>& trials);

}  // namespace crepes::study
