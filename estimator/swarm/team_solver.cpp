#include "estimator/swarm/team_solver.hpp"

#include <optional>

#include "estimator/graph/pose_graph.hpp"

namespace crepes {

Event TeamSolver::solve(const TeamProblem& problem, const GraphConfig& config) {
  if (const auto* interval = std::get_if<TeamInterval>(&problem)) {
    const std::optional<TeamSolution> by_peer = peer_view_.step(*interval, filter_.belief());
    const TeamSolution own = filter_.step(*interval);
    return by_peer.value_or(own);
  }
  return solve_pose_graph(std::get<GraphProblem>(problem), config);
}

}  // namespace crepes
