/// What SIGHUP does: the configuration is read again.
#pragma once

#include <string>

#include "daemon/runtime.hpp"
#include "estimator/core/clock.hpp"

namespace crepes {

/// Applies what `file` changes and can be changed live; tells what cannot, in the log and in
/// STATUS. A faulty file changes nothing, and all its faults are logged. `machine` is the clock
/// that systemd is told.
void reload(const std::string& file, Runtime& runtime, const Clock& machine);

}  // namespace crepes
