/// Simulated devices in place of real ones: bytes into pseudo-terminals, which the real readers
/// open.
#pragma once

#include <cstddef>
#include <stop_token>

#include "daemon/counters.hpp"
#include "daemon/sensor_stages.hpp"
#include "drivers/sim/sim_clock.hpp"
#include "drivers/sim/sim_serial.hpp"
#include "drivers/sim/world.hpp"
#include "estimator/core/config.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// The devices of robot `config.robot.id`; `world` must outlive them.
[[nodiscard]] Result<SimSerial> open_sim_imu(const SimWorld& world, const Config& config);
[[nodiscard]] Result<SimSerial> open_sim_uwb(const SimWorld& world, const Config& config);
/// Opens camera `index` of the configuration; both references must outlive what it opens.
[[nodiscard]] OpenCamera sim_camera(const SimWorld& world, const Config& config, std::size_t index,
                                    const SimClock& clock);

/// Sends what the device says, when it says it, until `stop`.
void run_sim_serial(SimSerial& device, const SimClock& clock, Counter& turns,
                    const std::stop_token& stop);

}  // namespace crepes
