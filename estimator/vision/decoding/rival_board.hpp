/// Compares the board that is assigned to a light with all others, over the time of doubt.
#pragma once

#include "estimator/vision/decoding/blink_evidence.hpp"
#include "estimator/vision/decoding/source_models.hpp"

namespace crepes {

/// The log odds [nats] that another board of the library, in the clear, has been blinking here
/// after `since`, against the assigned board of which frames are hidden. A board that is lit only
/// where the assigned one is looks like that one behind a propeller, frame by frame; over a pattern
/// it does not. `evidence` must have an assigned code.
[[nodiscard]] double rival_log_odds(const BlinkEvidence& evidence, const SourceModels& sources,
                                    Timestamp since);

}  // namespace crepes
