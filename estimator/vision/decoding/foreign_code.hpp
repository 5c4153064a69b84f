/// Tells boards of other swarms, whose codes are as long as ours, from our own.
#pragma once

#include <cstddef>

#include "estimator/vision/decoding/blink_window.hpp"
#include "estimator/vision/decoding/code_model.hpp"

namespace crepes {

/// How much better [nats] the best of all patterns with as many slots explains the window than
/// `code` in `phase`: the generalized likelihood ratio. About zero for a board that blinks the
/// code; its flipped frames seldom repeat in each period. About four nats a frame for one whose
/// code differs. Zero for codes that are no patterns.
[[nodiscard]] double foreign_log_ratio(const BlinkWindow& window, const CodeModel& code,
                                       std::size_t phase);

}  // namespace crepes
