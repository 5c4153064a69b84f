/// How likely a light is which board, by what it has shown and by what is known beforehand.
#pragma once

#include <cstddef>

#include "estimator/core/time.hpp"
#include "estimator/vision/decoding/blink_evidence.hpp"
#include "estimator/vision/decoding/phase_memory.hpp"
#include "estimator/vision/decoding/source_models.hpp"

namespace crepes {

/// The most likely board of a light against everything else that the light may be.
struct IdPosterior {
  std::size_t best = 0;  ///< code of the library
  double others = 0.0;   ///< posterior of all other codes of the library, relative to the best one
  double clutter = 0.0;  ///< the same of sources that are no boards

  /// The posterior probability of the best code.
  [[nodiscard]] double probability() const { return 1.0 / (1.0 + others + clutter); }
};

/// `evidence` has scores, but no code is assigned. A board that returns in its `known` phase is
/// more likely than one in any phase.
[[nodiscard]] IdPosterior posterior_of(const BlinkEvidence& evidence, const SourceModels& sources,
                                       Timestamp now, const PhaseMemory& known);

/// The log of the mean likelihood of all sources, by their priors.
[[nodiscard]] double log_evidence(const BlinkEvidence& evidence, const SourceModels& sources);

}  // namespace crepes
