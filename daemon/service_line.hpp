/// How the daemon is, in one line for `systemctl status`.
#pragma once

#include <string>

#include "estimator/core/outputs.hpp"

namespace crepes {

/// As in "1 of 2 neighbors located (r3: not seen); imu: no such file". At most 400 bytes or so.
[[nodiscard]] std::string service_line(const SystemStatus& status);

}  // namespace crepes
