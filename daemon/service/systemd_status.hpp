/// The state of the daemon in one line, for `systemctl status`.
#pragma once

#include <string>

#include "estimator/core/outputs.hpp"
#include "net/subscription/system_status.hpp"

namespace crepes {

/// For example "1 of 2 neighbors located (r3: not seen); imu: no such file". About 400 bytes at
/// most.
[[nodiscard]] std::string systemd_status(const SystemStatus& status);

}  // namespace crepes
