/// Compares the board that a light is taken for with all others, where frames may be hidden.
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

/// The log odds [nats] that another board of the library has been blinking here after `since` and
/// not `match`, by all frames: also by those that a blade may have darkened, which count for
/// nothing one by one. A blade darkens any of them; a board that looks like another one behind a
/// blade is dark in the same slots of each period. The lowest where there are no such frames.
[[nodiscard]] double shaded_log_odds(const BlinkEvidence& evidence, const SourceModels& sources,
                                     CodeMatch match, Timestamp since);

}  // namespace crepes
