/// What SIGHUP does: read the configuration again.
#pragma once

#include <string>

#include "daemon/runtime.hpp"
#include "daemon/service/robot_lock.hpp"
#include "estimator/core/clock.hpp"

namespace crepes {

/// Applies the live changes in `file` and logs its warnings. Reports the changes that need a
/// restart in the log and in STATUS. A faulty file changes nothing, and all its faults are logged.
/// `lock` follows to another mesh; one on which a daemon has the robot's id is refused. `machine`
/// is the clock whose time systemd expects.
void reload(const std::string& file, Runtime& runtime, RobotLock& lock, const Clock& machine);

}  // namespace crepes
