/// Configuration commands for WitMotion inertial sensors.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <vector>

#include "drivers/serial/serial_port.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

using WitMotionCommand = std::array<std::uint8_t, 5>;

/// Unlock; output acceleration and rate only, so that the line's rate is sufficient; set `rate_hz`;
/// save. Refuses rates that the sensor does not support.
[[nodiscard]] Result<std::vector<WitMotionCommand>> witmotion_setup(int rate_hz);

/// The sensor executes one command at a time: waits `pause` after each.
[[nodiscard]] Result<void> send_commands(SerialPort& port,
                                         const std::vector<WitMotionCommand>& commands,
                                         std::chrono::milliseconds pause);

}  // namespace crepes
