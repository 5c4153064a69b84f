/// One daemon a robot on this machine.
#pragma once

#include <string>

#include "drivers/base/unique_fd.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Claims a robot's id on a mesh while the returned descriptor is open. kBusy if another process
/// has it. The kernel ends the claim with the process, so nothing is left behind.
[[nodiscard]] Result<UniqueFd> lock_robot(RobotId robot, const std::string& interface, int port);

}  // namespace crepes
