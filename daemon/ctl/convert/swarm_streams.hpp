/// The topics of a recorded swarm: what each robot measured, and where it truly was.
#pragma once

#include <vector>

#include "daemon/ctl/convert/message_stream.hpp"
#include "daemon/ctl/dataset/swarm_dataset.hpp"
#include "daemon/ctl/dataset/truth.hpp"

namespace crepes {

/// For each robot /NAME/imu, /NAME/range/NEIGHBOR and, for each camera, /NAME/camK/spots and
/// /NAME/camK/image. Times are those of the recording, by the manifest's clocks.
[[nodiscard]] std::vector<MessageStream> swarm_streams(const SwarmDataset& dataset);

/// /tf: where each robot truly was in `world`, 50 times a second.
[[nodiscard]] std::vector<MessageStream> truth_streams(const SwarmManifest& manifest,
                                                       const SwarmTruth& truth);

}  // namespace crepes
