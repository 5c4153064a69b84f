#include "daemon/graph_stage.hpp"

#include <chrono>
#include <optional>

#include "estimator/graph/pose_graph.hpp"

namespace crepes {

void run_graph(GraphConfig config, GraphQueue& problems,
               const std::function<void(GraphSolution)>& answer, const StageContext& context,
               const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    context.turns.add();
    if (const auto wanted = context.settings.try_pop()) config = wanted->graph;
    std::optional<GraphProblem> problem = problems.pop_for(std::chrono::milliseconds{100}, stop);
    // Only the newest is worth an answer.
    while (auto newer = problem ? problems.try_pop() : std::nullopt) problem = std::move(newer);
    if (problem) answer(solve_pose_graph(*problem, config));
  }
}

}  // namespace crepes
