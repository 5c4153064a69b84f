#include "estimator/vision/decoding/dark_runs.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace crepes {
namespace {

constexpr Duration kCodeStep = std::chrono::microseconds{500};  // in which a code is examined

// A source that goes dark so many times as often as a board can, of late, is behind a propeller.
constexpr double kObstructedRuns = 1.25;
constexpr double kClearRuns = 1.0;
constexpr double kRunMemory = 0.3;  // s

}  // namespace

Duration longest_dark_of(const BlinkCode& code) {
  Duration longest{};
  Duration current{};
  for (Duration t{}; t < 2 * code.period(); t += kCodeStep) {
    current = code.is_lit(t) ? Duration{} : current + kCodeStep;
    longest = std::max(longest, current);
  }
  return longest;
}

double most_dark_runs_of(const BlinkCode& code) {
  const Duration settled = from_seconds(4.0 * kRunMemory) + code.period();
  const double fading = std::exp(-to_seconds(kCodeStep) / kRunMemory);
  double runs = 0.0;
  double most = 0.0;
  bool was_lit = true;
  for (Duration t{}; t < settled; t += kCodeStep) {
    const bool is_lit = code.is_lit(t);
    runs = fading * runs + (was_lit && !is_lit ? 1.0 : 0.0);
    most = std::max(most, runs);
    was_lit = is_lit;
  }
  return most;
}

bool count_dark_run(BlinkEvidence& evidence, Timestamp stamp, double most_dark_runs) {
  if (!evidence.last_lit) return false;
  evidence.dark_runs *= std::exp(-to_seconds(stamp - *evidence.last_lit) / kRunMemory);
  evidence.dark_runs += evidence.pending_dark.empty() ? 0.0 : 1.0;
  const double most = (evidence.is_obstructed ? kClearRuns : kObstructedRuns) * most_dark_runs;
  const bool was_obstructed = std::exchange(evidence.is_obstructed, evidence.dark_runs > most);
  return evidence.is_obstructed != was_obstructed;
}

}  // namespace crepes
