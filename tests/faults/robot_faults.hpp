/// Faults of a robot as a whole: power, clock, keys, configuration.
#pragma once

#include <functional>
#include <vector>

#include "daemon/ctl/replay/virtual_swarm.hpp"
#include "tests/faults/fault.hpp"

namespace crepes::faults {

/// Something that happens to the swarm at an instant.
struct Action {
  double at_s = 0.0;  ///< true time
  std::function<void(VirtualSwarm&)> apply;
};

/// In order of time. Every change is taken back when its fault ends, except what a clock is ahead,
/// a robot that was killed, and a new key of the swarm, which its last robot then takes too.
[[nodiscard]] std::vector<Action> actions_of(const std::vector<Fault>& faults);

}  // namespace crepes::faults
