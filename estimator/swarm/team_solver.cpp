#include "estimator/swarm/team_solver.hpp"

#include "estimator/graph/pose_graph.hpp"

namespace crepes {

Event TeamSolver::solve(const TeamProblem& problem, const GraphConfig& config) {
  if (const auto* interval = std::get_if<TeamInterval>(&problem)) return filter_.step(*interval);
  return solve_pose_graph(std::get<GraphProblem>(problem), config);
}

}  // namespace crepes
