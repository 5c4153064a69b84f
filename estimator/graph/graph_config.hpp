/// Settings: the estimation of the whole team.
#pragma once

#include <array>
#include <cstdint>

#include "estimator/core/settings_schema.hpp"

namespace crepes {

/// The cost of an edge of the pose graph.
enum class GraphCost : std::uint8_t { kLie, kPaper };
inline constexpr std::array kGraphCosts{Choice{"lie", GraphCost::kLie},
                                        Choice{"paper", GraphCost::kPaper}};

/// How the team is estimated. `kTeamFilter` needs the tight profile.
enum class TeamMethod : std::uint8_t { kPoseGraph, kTeamFilter };
inline constexpr std::array kTeamMethods{Choice{"pose_graph", TeamMethod::kPoseGraph},
                                         Choice{"team_filter", TeamMethod::kTeamFilter}};

/// The estimation of the whole team.
struct GraphConfig {
  bool enabled = true;
  TeamMethod method = TeamMethod::kTeamFilter;
  int team_size = 12;
  double rate_hz = 10.0;
  GraphCost cost = GraphCost::kLie;
  double kernel_scale = 3.0;
  int max_iterations = 20;

  [[nodiscard]] bool operator==(const GraphConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("enabled", enabled, "estimate the team as a whole, not only pairs");
    v.choice("method", method, kTeamMethods,
             "team_filter: from all robots' measurements; pose_graph: from the pairs' poses; the "
             "paper's profile always uses pose_graph");
    v.field("team_size", team_size, Bounds{3, 50},
            "robots that team_filter estimates jointly; its cost grows with the cube");
    v.field("rate_hz", rate_hz, Bounds{5, 20}, "solutions per second");
    v.choice("cost", cost, kGraphCosts, "lie: weighted by covariance; paper: ||T X^-1 X - I||_F^2");
    v.field("kernel_scale", kernel_scale, Bounds{0.1, 100},
            "residual norm [sigmas] above which the robust kernel reduces the weight");
    v.field("max_iterations", max_iterations, Bounds{1, 1000},
            "maximum number of iterations of one solution");
  }
};

}  // namespace crepes
