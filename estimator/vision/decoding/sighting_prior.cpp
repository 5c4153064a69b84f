#include "estimator/vision/decoding/sighting_prior.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "estimator/vision/decoding/code_model.hpp"
#include "estimator/vision/decoding/id_posterior.hpp"
#include "estimator/vision/decoding/phase_scores.hpp"

namespace crepes {
namespace {

constexpr double kLeastLikely = -50.0;  // nats; of what is as good as excluded

/// All of the likelihood is with the assigned code, in the phases that its clock may have by now.
void expect_assigned(BlinkEvidence& evidence, const SourceModels& sources, Duration absence) {
  const CodeMatch was = *evidence.assigned;
  const CodeModel& code = sources.codes()[was.code];
  const auto n = static_cast<std::int64_t>(code.phases);
  const std::int64_t reach = code.phase_reach(absence);
  const double share = static_cast<double>(2 * reach + 1) / static_cast<double>(n);
  sources.fill_scores(evidence, to_units(kLeastLikely));
  for (std::int64_t i = -reach; i <= reach; ++i) {
    const std::int64_t at = (static_cast<std::int64_t>(was.phase) + i + n) % n;
    evidence.score[code.first_score + static_cast<std::size_t>(at)] =
        to_units(-std::log(share) - code.log_share);
  }
  evidence.earlier_markov = kLeastLikely;
  evidence.expected = was.code;
}

/// Divides all likelihoods by their mean.
void normalize_scores(BlinkEvidence& evidence, const SourceModels& sources) {
  const double mean = log_evidence(evidence, sources);
  const int shift = to_units(mean);
  const int least = to_units(kLeastLikely);
  constexpr int kMost = std::numeric_limits<std::int16_t>::max();
  for (std::int16_t& score : evidence.score)
    score = static_cast<std::int16_t>(std::clamp(score - shift, least, kMost));
  evidence.earlier_markov = sources.log_markov(evidence) - mean;
}

}  // namespace

void make_prior(BlinkEvidence& evidence, const SourceModels& sources, Duration absence,
                double stranger) {
  if (evidence.assigned) {
    expect_assigned(evidence, sources, absence);
  } else {
    normalize_scores(evidence, sources);
  }
  const std::int16_t least = to_units(std::log(stranger));
  for (std::int16_t& score : evidence.score) score = std::max(score, least);
  evidence.earlier_markov = std::max(evidence.earlier_markov, std::log(stranger));
}

}  // namespace crepes
