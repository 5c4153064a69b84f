#include "estimator/vision/decoding/rival_board.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "estimator/vision/decoding/code_model.hpp"
#include "estimator/vision/decoding/phase_scores.hpp"

namespace crepes {
namespace {

constexpr double kLeastShown = 0.1;
constexpr double kMostShown = 0.98;
constexpr double kSure = 0.4;  // so far from one half a state is not in doubt

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

/// The log odds of `rival` against `ours` if something hides the light in frames of either alike.
/// Half an exposure at an edge looks lit or dark in each period, so such frames say nothing.
double log_odds_of(const CodeModel& rival, std::size_t rival_phase, const CodeModel& ours,
                   std::size_t our_phase, const BlinkWindow& window) {
  // Whether the rival is lit, ours is lit, and a light was seen.
  std::array<std::array<std::array<int, 2>, 2>, 2> frames{};
  for (std::size_t i = 0; i < window.size(); ++i) {
    const double p = rival.lit_probability(rival_phase, window[i].stamp);
    const double q = ours.lit_probability(our_phase, window[i].stamp);
    if (std::min(std::abs(p - 0.5), std::abs(q - 0.5)) < kSure) continue;
    ++frames.at(p > 0.5 ? 1 : 0).at(q > 0.5 ? 1 : 0).at(window[i].lit ? 1 : 0);
  }
  const auto& [hidden, seen] = frames[1][1];
  const double shown = std::clamp((seen + 0.5) / (seen + hidden + 1.0), kLeastShown, kMostShown);
  const double lit = std::log(shown / ours.flip_rate);
  const double dark = std::log((1.0 - shown) / (1.0 - ours.flip_rate));
  return lit * (frames[1][0][1] - frames[0][1][1]) + dark * (frames[1][0][0] - frames[0][1][0]);
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

double shaded_log_odds(const BlinkEvidence& evidence, const SourceModels& sources, CodeMatch match,
                       Timestamp since) {
  double best = std::numeric_limits<double>::lowest();
  if (evidence.shaded.size() == 0) return best;
  BlinkEvidence recent;
  sources.fill_scores(recent, 0);
  for (const BlinkWindow* const window : {&evidence.shaded, &evidence.window}) {
    for (std::size_t i = 0; i < window->size() && !recent.window.is_full(); ++i) {
      if ((*window)[i].stamp <= since) continue;
      recent.window.push((*window)[i]);
      sources.score(recent, (*window)[i], 1);
    }
  }
  const CodeModel& ours = sources.boards()[match.code];
  for (std::size_t c = 0; c < sources.boards().size(); ++c) {
    if (c == match.code) continue;
    const CodeModel& rival = sources.boards()[c];
    const std::size_t phase = best_phase(SourceModels::scores_of(recent, rival));
    best = std::max(best, log_odds_of(rival, phase, ours, match.phase, recent.window));
  }
  return best;
}

}  // namespace crepes
