/// How well anyone could know a team: the posterior Cramer-Rao bound of all that was measured.
#pragma once

#include <map>
#include <utility>

#include "tests/study/pair_bound.hpp"

namespace crepes::study {

/// Of T_B_N, by observer and neighbor.
using TeamBound = std::map<std::pair<RobotId, RobotId>, PairBound>;

/// The bound of every ordered pair from what all robots measured (as `pair_bound`, which uses what
/// two measured of each other). One recursion estimates all robots relative to the first. States:
/// p, v and R of each other robot in its body frame; of each robot gyro and accelerometer biases,
/// their scale and axis errors unless their prior is zero, and the misalignment of its cameras,
/// which all its pairs share; a constant range bias of each pair. What is measured within 20 ms
/// counts as if measured at the end of them: with a Jacobian of an earlier instant, states and
/// readings would disagree, and the bound would be too small. Statistics from `after_s` on, 50 Hz.
[[nodiscard]] TeamBound team_bound(const Swarm& swarm, const SensorPriors& priors, double after_s);

/// Root mean square (and mean of medians) over the pairs of `bound`.
[[nodiscard]] PairBound pooled(const TeamBound& bound);

}  // namespace crepes::study
