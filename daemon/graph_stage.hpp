/// The loop that solves the pose graph, apart from the estimator because it takes its time.
#pragma once

#include <functional>
#include <stop_token>

#include "daemon/bounded_queue.hpp"
#include "daemon/sensor_stages.hpp"
#include "estimator/core/config.hpp"
#include "estimator/core/measurements.hpp"

namespace crepes {

using GraphQueue = BoundedQueue<GraphProblem>;

/// Solves what comes until `stop`.
void run_graph(GraphConfig config, GraphQueue& problems,
               const std::function<void(GraphSolution)>& answer, const StageContext& context,
               const std::stop_token& stop);

}  // namespace crepes
