/// How long and how often a code is dark, and sources that are dark more often than any code.
#pragma once

#include "estimator/core/time.hpp"
#include "estimator/vision/decoding/blink_evidence.hpp"
#include "estimator/vision/id_library.hpp"

namespace crepes {

/// The longest time for which the code is dark.
[[nodiscard]] Duration longest_dark_of(const BlinkCode& code);

/// The most that BlinkEvidence::dark_runs becomes before a board in the clear.
[[nodiscard]] double most_dark_runs_of(const BlinkCode& code);

/// Counts the dark frames that end with a lit one at `stamp`, and decides whether the source is
/// obstructed: whether it goes dark more often than the `most_dark_runs` of any board. A blade is
/// shorter before the light than two frames are apart. So it hides single frames, or one at either
/// end of a dark slot. Returns whether the decision changed.
[[nodiscard]] bool count_dark_run(BlinkEvidence& evidence, Timestamp stamp, double most_dark_runs);

}  // namespace crepes
