/// The team's poses by the most certain chain of edges to each robot.
#pragma once

#include <map>
#include <vector>

#include "estimator/core/measurements.hpp"

namespace crepes {

/// Pose in self's body frame of every robot that edges, taken in either direction, connect to
/// `self`; by the chain with the smallest position variance (Dijkstra 1959), its edges' errors
/// taken as independent. Self is in it.
[[nodiscard]] std::map<RobotId, GaussianPose> spanning_tree_poses(
    RobotId self, const std::vector<RelativePoseEdge>& edges);

}  // namespace crepes
