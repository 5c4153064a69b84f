#include "estimator/swarm/team_solver.hpp"

#include <optional>

#include "estimator/graph/pose_graph.hpp"

namespace crepes {

Event TeamSolver::solve(const TeamProblem& problem, const GraphConfig& config) {
  if (const auto* interval = std::get_if<TeamInterval>(&problem)) {
    std::optional<PeerView::View> by_peer = peer_view_.step(*interval, filter_.belief());
    TeamSolution own = filter_.step(*interval);
    if (!by_peer) return own;
    if (by_peer->belief) filter_.replace(*std::move(by_peer->belief));
    return std::move(by_peer->solution);
  }
  return solve_pose_graph(std::get<GraphProblem>(problem), config);
}

}  // namespace crepes
