/// The same belief in the frame of another robot.
#pragma once

#include "estimator/team/belief/team_belief.hpp"

namespace crepes {

/// What is believed, in the frame that falls freely with this robot at the keyframe and by its
/// clock. The robot must have a place.
[[nodiscard]] TeamBelief seen_from(RobotId id, const TeamBelief& belief);

}  // namespace crepes
