/// What is right and wrong with a robot's mesh and with the clocks that it compares over it.
#pragma once

#include "daemon/ctl/live/check/findings.hpp"

namespace crepes {

/// Whether the offsets to the neighbors' clocks are known.
void check_clocks(const RobotObservation& seen, CheckSection section);
/// Keys, air time, links, and what was refused.
void check_mesh(const RobotObservation& seen, CheckSection section);

}  // namespace crepes
