/// Tests whether a light still is the board that was assigned to it.
#pragma once

#include "estimator/core/time.hpp"
#include "estimator/vision/decoding/blink_evidence.hpp"

namespace crepes {

/// Page's test (CUSUM) for a change of the source, after one frame of a light that has an assigned
/// code: the log odds g that another board has been blinking here since some past frame,
///   g <- max(0, g + ln(((1 - d) p + d q) / p)),
/// where p is the likelihood of the frame under the assigned code, q that under its opposite, and d
/// the share of frames in which another board differs. It runs twice: for a source in the clear,
/// and for one that is hidden in half of the frames, whose darkness says little.
/// `p_lit`: the probability that the assigned code is lit in the frame of the observation.
void test_frame(BlinkEvidence& evidence, BlinkObservation seen, double p_lit);

/// The doubt that what is lit after an `absence` is what was: none in frames that follow each
/// other, and so much beyond a `brief` absence that fifteen frames in a row have to agree.
void doubt_after_absence(BlinkEvidence& evidence, Duration absence, Duration brief);

/// Removes all doubt: the code was decided anew at `now`.
void clear_doubt(BlinkEvidence& evidence, Timestamp now);

/// Whether a code is assigned and beyond doubt.
[[nodiscard]] bool is_undoubted(const BlinkEvidence& evidence);
/// Whether there is no more doubt than an absence causes.
[[nodiscard]] bool may_have_returned(const BlinkEvidence& evidence);
/// Whether the light is almost certainly another one.
[[nodiscard]] bool has_changed(const BlinkEvidence& evidence);
/// Whether the light is almost certainly another one unless something hides it at times.
[[nodiscard]] bool has_changed_or_is_obstructed(const BlinkEvidence& evidence);
/// Whether log odds of another board [nats] leave no room for the assigned one.
[[nodiscard]] bool is_lost_to(double rival_log_odds);

}  // namespace crepes
