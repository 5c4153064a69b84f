/// A robot's pose at the keyframe, by this robot's clock.
#pragma once

#include "estimator/core/team_solution.hpp"
#include "estimator/team/belief/team_arcs.hpp"
#include "estimator/team/belief/team_belief.hpp"

namespace crepes {

/// T_S_N with S this robot, at the keyframe by this robot's clock, and its covariance with the
/// IMUs' biases of both. `TeamBelief::pose` is where the robot was when its own clock showed that
/// time; the last IMU sample of `member`, the same robot, carries it from there.
[[nodiscard]] TeamPose keyframe_pose(const TeamBelief& belief, const TeamArcs& arcs, RobotId id,
                                     const TeamMember& member);

}  // namespace crepes
