/// The state of the daemon in one line, for `systemctl status`.
#pragma once

#include <string>

#include "estimator/core/outputs.hpp"
#include "net/subscription/system_status.hpp"

namespace crepes {

/// For example "1 of 2 neighbors located (r3: not seen); imu: no such file". UTF-8, and about 1100
/// bytes at most: systemd ignores what is not, and more than 4096.
[[nodiscard]] std::string systemd_status(const SystemStatus& status);

}  // namespace crepes
