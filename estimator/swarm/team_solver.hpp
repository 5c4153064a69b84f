/// The estimation of the whole team, of either profile.
#pragma once

#include <variant>

#include "estimator/core/event.hpp"
#include "estimator/graph/graph_config.hpp"
#include "estimator/team/peer_view.hpp"
#include "estimator/team/team_filter.hpp"

namespace crepes {

/// What the estimator asks of the team: the paper's pose graph, or the next interval of the team's
/// filter.
using TeamProblem = std::variant<GraphProblem, TeamInterval>;

/// Owned by the graph thread. Every interval must be solved, in order.
class TeamSolver {
 public:
  /// A GraphSolution or a TeamSolution.
  [[nodiscard]] Event solve(const TeamProblem& problem, const GraphConfig& config);

 private:
  TeamFilter filter_;
  PeerView peer_view_;
};

}  // namespace crepes
