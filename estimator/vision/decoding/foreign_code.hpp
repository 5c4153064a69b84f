/// Tells boards of other swarms, whose codes are as long as ours, from our own.
#pragma once

#include <cstddef>

#include "estimator/vision/decoding/blink_window.hpp"
#include "estimator/vision/decoding/code_model.hpp"

namespace crepes {

/// Whether the best of all patterns with as many slots, beginning when those of `code` in `phase`
/// do, explains the window better by more than `nats`: the generalized likelihood ratio. It is
/// about zero for a board that blinks the code, since flipped frames seldom repeat in each period,
/// and about four nats a frame for one whose code differs. Never for codes that are no patterns.
[[nodiscard]] bool is_explained_better(const BlinkWindow& window, const CodeModel& code,
                                       std::size_t phase, double nats);

}  // namespace crepes
