/// First guess of the team's poses: the most certain chain of edges to each robot.
#pragma once

#include <map>
#include <vector>

#include "estimator/core/measurements.hpp"

namespace crepes {

/// Pose in self's body frame of every robot that edges, taken in either direction, connect to
/// `self`; by the chain with the smallest sum of position variances (Dijkstra 1959). Self is in it.
[[nodiscard]] std::map<RobotId, Pose> spanning_tree_poses(
    RobotId self, const std::vector<RelativePoseEdge>& edges);

}  // namespace crepes
