/// Robots that are seen, but of which nobody of the team has an estimate.
#pragma once

#include <map>

#include "estimator/team/belief/team_interval.hpp"
#include "estimator/team/belief/team_place.hpp"

namespace crepes {

/// A robot without ranges starts no pair's filter, so that no estimate connects it with the others.
/// The bearings of two trusted robots show where it is, and its own ones of two of them how it is
/// turned (Wahba's problem; Markley 1988). `belief` is that at the end of the interval. Only robots
/// that no estimate connects with the belief, and that have an IMU.
[[nodiscard]] std::map<RobotId, TeamPlace> places_by_sight(const TeamInterval& interval,
                                                           const TeamBelief& belief);

}  // namespace crepes
