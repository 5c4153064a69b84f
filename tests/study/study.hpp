/// How near to the bound a profile comes.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tests/study/pair_bound.hpp"
#include "tests/study/pair_sightings.hpp"

namespace crepes::study {

/// Of one profile on one swarm, over all ordered pairs, without the pose graph.
struct Quality {
  double position_rmse_m = 0.0;
  double rotation_rmse_rad = 0.0;
  double median_nees = 0.0;
  double share_within_95 = 0.0;
  double worst_availability = 0.0;
  std::size_t divergences = 0;
};

/// One swarm, what is possible, and what was reached.
struct Trial {
  std::string name;
  PairBound bound;         ///< pooled over the same pairs
  PairBound scaled_bound;  ///< with kScaledPriors
  Quality tight;
  Quality paper;
};

/// Root mean square (and mean of medians) of the bounds of all ordered pairs.
[[nodiscard]] PairBound swarm_bound(const Swarm& swarm, const SensorPriors& priors, double after_s);

/// Replays in memory. The error says which input is wrong.
[[nodiscard]] Result<Quality> replay_quality(const Swarm& swarm, Profile profile, double after_s);

[[nodiscard]] Result<Trial> run_trial(const Swarm& swarm, double after_s);

/// RMSE over bound, root mean square over trials; NaN of none.
struct Ratio {
  double position = 0.0;
  double rotation = 0.0;
};
[[nodiscard]] Ratio pooled_ratio(const std::vector<Trial>& trials, Quality Trial::*profile,
                                 PairBound Trial::*bound = &Trial::bound);

/// A row for each trial, tight and paper side by side, and one for all of them.
[[nodiscard]] std::string table_of(const std::vector<Trial>& trials);

}  // namespace crepes::study
