/// Simulated devices instead of real ones: bytes written to pseudo-terminals, which the real
/// readers open.
#pragma once

#include <cstddef>
#include <stop_token>

#include "config/schema/config.hpp"
#include "daemon/devices/camera_sensor.hpp"
#include "daemon/stages/counters.hpp"
#include "drivers/sim/sim_clock.hpp"
#include "drivers/sim/sim_serial.hpp"
#include "drivers/sim/world.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// The devices of robot `config.robot.id`; `world` must outlive them.
[[nodiscard]] Result<SimSerial> open_sim_imu(const SimWorld& world, const Config& config);
[[nodiscard]] Result<SimSerial> open_sim_uwb(const SimWorld& world, const Config& config);
/// Opens camera `index` of the configuration. Both references must outlive the camera.
[[nodiscard]] OpenCamera sim_camera(const SimWorld& world, const Config& config, std::size_t index,
                                    const SimClock& clock);

/// Sends the device's messages at their times until `stop`.
void run_sim_serial(SimSerial& device, const SimClock& clock, Counter& iterations,
                    const std::stop_token& stop);

}  // namespace crepes
