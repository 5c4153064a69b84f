#include "daemon/stages/graph_stage.hpp"

#include <chrono>
#include <optional>

namespace crepes {

void run_graph(LiveSettings<GraphConfig>& settings, GraphQueue& problems,
               const std::function<void(Event)>& answer, const StageContext& context,
               const std::stop_token& stop) {
  GraphConfig config;
  TeamSolver solver;
  while (!stop.stop_requested()) {
    context.iterations.add();
    if (const auto renewed = settings.receive()) config = *renewed;
    std::optional<TeamProblem> problem = problems.pop_for(std::chrono::milliseconds{100}, stop);
    while (problem && std::holds_alternative<GraphProblem>(*problem) && !problems.empty())
      problem = problems.try_pop();
    if (problem) answer(solver.solve(*problem, config));
  }
}

}  // namespace crepes
