/// The loop that owns the Estimator: events in, outputs out, time as Ticks.
#pragma once

#include <functional>
#include <stop_token>

#include "daemon/bounded_queue.hpp"
#include "daemon/counters.hpp"
#include "daemon/sensor_stages.hpp"
#include "estimator/core/config.hpp"
#include "estimator/core/event.hpp"
#include "estimator/swarm/estimator.hpp"

namespace crepes {

using EventQueue = BoundedQueue<Event>;

/// Where the results go. Called from the estimator's thread; must not wait.
struct EstimatorSinks {
  std::function<void(Outputs)> publish;         ///< poses and the report
  std::function<void(GraphProblem)> solve;      ///< the answer comes back as an event
  std::function<void(EstimatorStatus)> inform;  ///< four times a second
  Counter& late_frames;                         ///< left out, see `run_estimator`
};

/// Steps the estimator until `stop`, with a Tick `estimator.output_rate_hz` times a second. Spots
/// that waited for longer than any bearing is waited for are left out: a computer that fell behind,
/// for it had other things to do, is up to date again at once.
void run_estimator(const Config& config, EventQueue& events, const EstimatorSinks& sinks,
                   const StageContext& context, const std::stop_token& stop);

}  // namespace crepes
