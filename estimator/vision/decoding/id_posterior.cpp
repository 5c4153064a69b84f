#include "estimator/vision/decoding/id_posterior.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "estimator/vision/decoding/code_model.hpp"
#include "estimator/vision/decoding/phase_scores.hpp"

namespace crepes {
namespace {

// Priors, as odds relative to a board of the library in any phase.
constexpr double kReturnOdds = 100.0;  // a board that returns in its known phase
constexpr double kStrangerOdds = 1.0;  // the same where another light is expected
constexpr double kImageOdds = 0.1;     // a second image of a board that is in sight

/// A board counts as in sight for this long.
constexpr Duration kInSight = std::chrono::milliseconds{200};
constexpr Duration kOldPhase = std::chrono::seconds{30};  // an older phase is too uncertain
constexpr double kImpossible = -1e9;
constexpr double kNegligible = 40.0;  // nats

/// Log likelihood plus log prior of a code whose phase continues from its last sighting.
double log_known(const BlinkEvidence& evidence, const SourceModels& sources, std::size_t code,
                 Timestamp now, const PhaseMemory& known) {
  const auto phase = known.of(code);
  if (!phase || now - phase->learned > kOldPhase) return kImpossible;
  const CodeModel& model = sources.codes()[code];
  const PhaseScores scores = SourceModels::scores_of(evidence, model);
  const auto n = static_cast<std::int64_t>(scores.size());
  const std::int64_t reach = model.phase_reach(now - phase->learned);
  if (2 * reach >= n) return kImpossible;
  double likelihood = 0.0;
  for (std::int64_t i = -reach; i <= reach; ++i) {
    const std::int64_t at = (static_cast<std::int64_t>(phase->phase) + i + n) % n;
    likelihood +=
        std::exp((scores[static_cast<std::size_t>(at)] - scores[phase->phase]) / kUnitsPerNat);
  }
  const double returns = evidence.expected ? kStrangerOdds : kReturnOdds;
  const double odds = now - phase->learned > kInSight ? returns : kImageOdds;
  const auto others = static_cast<double>(known.size() * static_cast<std::size_t>(2 * reach + 1));
  return scores[phase->phase] / kUnitsPerNat + std::log(likelihood * odds / others) +
         (sources.own() == code ? std::log(SourceModels::kMirrorShare) : 0.0);
}

}  // namespace

IdPosterior posterior_of(const BlinkEvidence& evidence, const SourceModels& sources, Timestamp now,
                         const PhaseMemory& known) {
  IdPosterior posterior;
  double best_log = kImpossible;
  const auto anywhere = [&](const CodeModel& code) {
    const PhaseScores scores = SourceModels::scores_of(evidence, code);
    const std::int16_t top = highest_score(scores);
    const double at_most = top / kUnitsPerNat + code.log_share;
    return at_most < best_log - kNegligible ? kImpossible : log_mean(scores, top) + code.log_share;
  };
  const auto boards = sources.boards();
  for (std::size_t c = 0; c < boards.size(); ++c) {
    // What is expected here in its phase has that in its score already.
    const double log_c =
        c == evidence.expected
            ? anywhere(boards[c])
            : std::max(anywhere(boards[c]), log_known(evidence, sources, c, now, known));
    if (log_c > best_log) {
      posterior.others = (posterior.others + 1.0) * std::exp(best_log - log_c);
      best_log = log_c;
      posterior.best = c;
    } else {
      posterior.others += std::exp(log_c - best_log);
    }
  }
  posterior.clutter = SourceModels::kMarkovOdds * std::exp(sources.log_markov(evidence) - best_log);
  for (const CodeModel& lamp : sources.lamps())
    posterior.clutter += std::exp(anywhere(lamp) - best_log);
  return posterior;
}

double log_evidence(const BlinkEvidence& evidence, const SourceModels& sources) {
  double top = sources.log_markov(evidence) + std::log(SourceModels::kMarkovOdds);
  double sum = 1.0;  // relative to the top
  for (const CodeModel& code : sources.codes()) {
    const PhaseScores scores = SourceModels::scores_of(evidence, code);
    const double log_code = log_mean(scores, highest_score(scores)) + code.log_share;
    sum = log_code > top ? sum * std::exp(top - log_code) + 1.0 : sum + std::exp(log_code - top);
    top = std::max(top, log_code);
  }
  return top + std::log(sum / (1.0 + SourceModels::kMarkovOdds + SourceModels::kLampOdds));
}

}  // namespace crepes
