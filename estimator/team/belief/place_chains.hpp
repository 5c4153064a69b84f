/// Where robots are that estimates connect with known ones.
#pragma once

#include <map>
#include <set>
#include <utility>
#include <vector>

#include "estimator/core/constants.hpp"
#include "estimator/team/belief/team_interval.hpp"
#include "estimator/team/belief/team_place.hpp"

namespace crepes {

// An estimate that starts a robot shares its errors with what follows, so it counts little.
inline constexpr double kStartPosition = 0.05;          // m
inline constexpr double kStartAttitude = radians(1.0);  // rad

/// What a peer estimates is not believed to be better, whatever it claims.
[[nodiscard]] Matrix6d start_floor();

/// Whether an estimate may place a robot: it is no liar's, and a pose with a covariance.
[[nodiscard]] bool can_place(const RelativePoseEdge& edge, const std::set<RobotId>& liars);

/// Members of the interval that are not known, each by the most certain chain of estimates, the
/// most certain first. Candidates are known without an estimate, but not better than by a chain. No
/// chain uses what `liars` estimate.
[[nodiscard]] std::vector<std::pair<RobotId, TeamPlace>> places_by_chains(
    std::map<RobotId, TeamPlace> known, std::map<RobotId, TeamPlace> candidates,
    const std::set<RobotId>& liars, const TeamInterval& interval);

}  // namespace crepes
