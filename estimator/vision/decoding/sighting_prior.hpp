/// What a light showed before it was hidden, as the prior of the light that is seen in its place.
#pragma once

#include "estimator/core/time.hpp"
#include "estimator/vision/decoding/blink_evidence.hpp"
#include "estimator/vision/decoding/source_models.hpp"

namespace crepes {

/// Turns the scores of `evidence`, whose light was last seen `absence` ago, into those of a source
/// that may have been replaced. With s = `stranger`, the probability of that:
///   L(code, phase) <- (1 - s) L(code, phase) / mean L + s.
/// An assigned code becomes the expected one, with all of the likelihood. The observations remain.
void make_prior(BlinkEvidence& evidence, const SourceModels& sources, Duration absence,
                double stranger);

}  // namespace crepes
