/// Setting up WitMotion inertial sensors.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <vector>

#include "drivers/serial/serial_port.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

using WitMotionCommand = std::array<std::uint8_t, 5>;

/// Unlock; send acceleration and rate and nothing else, so that the line can carry them; `rate_hz`;
/// save. Refuses rates that the sensor does not have.
[[nodiscard]] Result<std::vector<WitMotionCommand>> witmotion_setup(int rate_hz);

/// The sensor takes one command at a time: waits `pause` after each.
[[nodiscard]] Result<void> send_commands(SerialPort& port,
                                         const std::vector<WitMotionCommand>& commands,
                                         std::chrono::milliseconds pause);

}  // namespace crepes
