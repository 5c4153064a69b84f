/// The loop that estimates the whole team. It is separate from the estimator because a solution
/// takes time.
#pragma once

#include <functional>
#include <stop_token>

#include "daemon/stages/bounded_queue.hpp"
#include "daemon/stages/live_settings.hpp"
#include "daemon/stages/stage_context.hpp"
#include "estimator/swarm/team_solver.hpp"

namespace crepes {

using GraphQueue = BoundedQueue<TeamProblem>;

/// Solves problems until `stop`. Of pose graphs only the newest, of intervals every one.
void run_graph(LiveSettings<GraphConfig>& settings, GraphQueue& problems,
               const std::function<void(Event)>& answer, const StageContext& context,
               const std::stop_token& stop);

}  // namespace crepes
