/// The pose graph over the team (paper III-E): one node a robot, one edge a measured relative pose.
#pragma once

#include "estimator/core/measurements.hpp"
#include "estimator/graph/graph_config.hpp"

namespace crepes {

/// Solves for the poses of all robots that edges connect to `input.self`, in self's body frame.
///
/// Two edges over one pair of robots rest on the same measurements, so each pair carries the weight
/// of one. Edges that are not finite or whose covariance is not positive definite do not count.
/// Edges share errors that more of them do not average away (a robot's camera and its calibration
/// are in all of its edges), so a covariance is that of the most certain chain, and no less.
/// Deterministic; bounded by `config.max_iterations`.
[[nodiscard]] GraphSolution solve_pose_graph(const GraphProblem& input, const GraphConfig& config);

}  // namespace crepes
