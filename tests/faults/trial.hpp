/// One swarm with faults, and what must hold nevertheless.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tests/faults/fault.hpp"
#include "tests/study/pair_sightings.hpp"

namespace crepes::faults {

/// When faults happen, and how long the swarm flies [s].
inline constexpr double kFirstFault_s = 5.0;
inline constexpr double kLastFault_s = 11.0;
inline constexpr double kDuration_s = 17.0;
inline constexpr double kRecovery_s = 2.0;  ///< after the last fault

using Pair = std::pair<RobotId, RobotId>;  ///< observer and neighbor

/// What one pair's poses were like.
struct PairOutcome {
  std::size_t not_finite = 0;
  double longest_beyond_s = 0.0;   ///< poses off by more than 5 sigma (Mahalanobis^2 > 35), on end
  double worst_beyond_m = 0.0;     ///< of those
  double longest_absence_s = 0.0;  ///< without a pose, after the recovery
  double rmse_m = 0.0;             ///< after the recovery
  std::uint64_t hash = 0;          ///< of all poses
};

using Outcome = std::map<Pair, PairOutcome>;

/// Replays the swarm with these faults. `recovered_s`: from when on the poses count for absence and
/// error. An error of the replay ends the program.
[[nodiscard]] Outcome run(const study::Swarm& swarm, const std::vector<Fault>& faults,
                          double recovered_s);

/// When the swarm must have recovered from the faults.
[[nodiscard]] double recovered_s(const std::vector<Fault>& faults);

/// What went wrong, one line each; empty if all that is promised held. `reference` is the outcome
/// without faults.
[[nodiscard]] std::vector<std::string> broken_promises(const std::vector<Fault>& faults,
                                                       const Outcome& outcome,
                                                       const Outcome& reference);

/// A swarm of a seed and its faults; the smallest part of them that still breaks a promise.
struct Verdict {
  std::vector<Fault> faults;
  std::vector<std::string> broken;
};
[[nodiscard]] Verdict try_seed(std::uint64_t seed);

}  // namespace crepes::faults
