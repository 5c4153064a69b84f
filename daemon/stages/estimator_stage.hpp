/// The loop that owns the Estimator: events in, outputs out, time as Ticks.
#pragma once

#include <functional>
#include <stop_token>

#include "daemon/stages/bounded_queue.hpp"
#include "daemon/stages/counters.hpp"
#include "daemon/stages/live_settings.hpp"
#include "daemon/stages/picture_tap.hpp"
#include "daemon/stages/stage_context.hpp"
#include "estimator/core/event.hpp"
#include "estimator/swarm/estimator.hpp"

namespace crepes {

using EventQueue = BoundedQueue<Event>;

/// The receivers of the results. Called in the estimator's thread; they must not block.
struct EstimatorSinks {
  std::function<void(Outputs)> publish;                 ///< poses and the report
  std::function<void(TeamProblem)> solve_team;          ///< the answer comes back as an event
  std::function<void(EstimatorStatus)> publish_status;  ///< four times a second
  std::function<void(PictureRobots)> sight{};           ///< the robots in a picture, if any
  Counter& late_frames;                                 ///< dropped, see `run_estimator`
};

/// Steps the estimator until `stop`, with a Tick `filters.output_rate_hz` times a second. Drops
/// spots that are older than the estimator waits for any bearing. So a computer that fell behind is
/// up to date again immediately.
void run_estimator(LiveSettings<EstimatorSettings>& settings, EventQueue& events,
                   const EstimatorSinks& sinks, const StageContext& context,
                   const std::stop_token& stop);

}  // namespace crepes
