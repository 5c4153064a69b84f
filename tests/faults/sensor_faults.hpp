/// Faults of one robot's sensors, applied to a recording.
#pragma once

#include "daemon/ctl/dataset/swarm_dataset.hpp"
#include "tests/faults/fault.hpp"

namespace crepes::faults {

/// Changes what the robot records while the fault lasts. Other kinds change nothing.
void apply_to_sensors(const Fault& fault, SwarmDataset& dataset);

}  // namespace crepes::faults
