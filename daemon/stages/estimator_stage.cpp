#include "daemon/stages/estimator_stage.hpp"

#include <algorithm>
#include <chrono>
#include <utility>
#include <variant>

namespace crepes {
namespace {

constexpr Duration kStatusPeriod = std::chrono::milliseconds{250};
constexpr Duration kLongestWait = std::chrono::milliseconds{100};

Duration patience(const EstimatorConfig& filters) { return from_seconds(2e-3 * filters.lag_ms); }

bool is_late(const Event& event, Timestamp oldest) {
  const auto* const frame = std::get_if<SpotFrame>(&event);
  return frame != nullptr && frame->stamp < oldest;
}

void hand_on(Outputs outputs, const EstimatorSinks& sinks) {
  if (outputs.team_problem) sinks.solve_team(std::move(*std::exchange(outputs.team_problem, {})));
  if (!outputs.poses.empty() || outputs.report) sinks.publish(std::move(outputs));
}

void hand_on_sighting(const Event& event, Outputs& outputs, const EstimatorSinks& sinks) {
  const auto* const frame = std::get_if<SpotFrame>(&event);
  if (frame == nullptr || outputs.bearings.empty() || !sinks.sight) return;
  sinks.sight({frame->stamp, frame->camera, std::exchange(outputs.bearings, {})});
}

}  // namespace

void run_estimator(LiveSettings<EstimatorSettings>& settings, EventQueue& events,
                   const EstimatorSinks& sinks, const StageContext& context,
                   const std::stop_token& stop) {
  const Clock& clock = context.clock;
  const EstimatorSettings initial = settings.receive().value();
  Duration period = from_seconds(1.0 / initial.filters.output_rate_hz);
  Duration wait_for_frames = patience(initial.filters);
  Estimator estimator(initial);
  Timestamp next_tick = clock.now() + period;
  Timestamp next_status = next_tick;
  while (!stop.stop_requested()) {
    context.iterations.add();
    if (const auto renewed = settings.receive()) {
      estimator.reconfigure(*renewed);
      period = from_seconds(1.0 / renewed->filters.output_rate_hz);
      wait_for_frames = patience(renewed->filters);
    }
    // Waiting events first: a Tick means that all events before it have been processed.
    std::optional<Event> event = events.try_pop();
    if (const Duration wait = next_tick - clock.now(); !event && wait > Duration::zero())
      event = events.pop_for(std::min(wait, kLongestWait), stop);
    if (event && is_late(*event, clock.now() - wait_for_frames)) {
      sinks.late_frames.add();
    } else if (event) {
      Outputs outputs = estimator.step(*event);
      hand_on_sighting(*event, outputs, sinks);
      hand_on(std::move(outputs), sinks);
    }
    if (clock.now() < next_tick) continue;
    const Timestamp tick = clock.now();
    hand_on(estimator.step(Tick{tick}), sinks);
    // A late loop skips ticks instead of catching up.
    next_tick = next_tick + period > tick ? next_tick + period : tick + period;
    if (tick < next_status) continue;
    sinks.publish_status(estimator.status());
    next_status = tick + kStatusPeriod;
  }
}

}  // namespace crepes
