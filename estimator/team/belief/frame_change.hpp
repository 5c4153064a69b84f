/// Moves the team's frame to where this robot is at the next keyframe.
#pragma once

#include "estimator/team/belief/team_belief.hpp"

namespace crepes {

/// Carries all motions of the belief, and their covariance, along `paths` to the end of these, and
/// from there into the frame that then falls freely with this robot. `paths` has all robots of the
/// belief. Nothing else changes: neither stamp nor calibrations.
void change_frame(const TeamTrajectories& paths, TeamBelief& belief);

}  // namespace crepes
