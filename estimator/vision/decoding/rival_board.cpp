#include "estimator/vision/decoding/rival_board.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/vision/decoding/code_model.hpp"
#include "estimator/vision/decoding/phase_scores.hpp"

namespace crepes {
namespace {

constexpr double kLeastShown = 0.1;
constexpr double kMostShown = 0.98;

/// The log likelihood of the assigned code with the share of lit frames shown that explains the
/// observations best.
double log_partly_hidden(const BlinkEvidence& recent, const CodeModel& code, std::size_t phase) {
  double expected = 0.0;
  double lit = 0.0;
  for (std::size_t i = 0; i < recent.window.size(); ++i) {
    expected += code.lit_probability(phase, recent.window[i].stamp);
    lit += recent.window[i].lit ? 1.0 : 0.0;
  }
  const double shown = std::clamp(lit / expected, kLeastShown, kMostShown);
  double log_likelihood = 0.0;
  for (std::size_t i = 0; i < recent.window.size(); ++i) {
    const double p = shown * code.lit_probability(phase, recent.window[i].stamp);
    log_likelihood += std::log(recent.window[i].lit ? p : 1.0 - p);
  }
  return log_likelihood;
}

}  // namespace

double rival_log_odds(const BlinkEvidence& evidence, const SourceModels& sources, Timestamp since) {
  BlinkEvidence recent;
  sources.fill_scores(recent, 0);
  for (std::size_t i = 0; i < evidence.window.size(); ++i) {
    const BlinkObservation& observation = evidence.window[i];
    if (observation.stamp <= since) continue;
    recent.window.push(observation);
    sources.score(recent, observation, 1);
  }
  const auto [assigned, phase] = *evidence.assigned;
  double best = std::numeric_limits<double>::lowest();
  for (std::size_t c = 0; c < sources.boards().size(); ++c) {
    if (c == assigned) continue;
    const PhaseScores scores = SourceModels::scores_of(recent, sources.boards()[c]);
    best = std::max(best, log_mean(scores, highest_score(scores)) + sources.boards()[c].log_share);
  }
  return best - log_partly_hidden(recent, sources.boards()[assigned], phase);
}

}  // namespace crepes
