/// Velocities of a team whose poses are known.
#pragma once

#include <map>
#include <vector>

#include "estimator/core/measurements.hpp"

namespace crepes {

/// v_self_i = R_W_self^T (v_W_i - v_W_self) of every robot in `T_self`, by least squares over
///   R_self_i v_i_j = v_self_j - v_self_i.
/// In these axes relative velocities add up along a chain: no term in the body rates appears.
[[nodiscard]] std::map<RobotId, Eigen::Vector3d> team_velocities(
    RobotId self, const std::map<RobotId, Pose>& T_self,
    const std::vector<RelativePoseEdge>& edges);

}  // namespace crepes
