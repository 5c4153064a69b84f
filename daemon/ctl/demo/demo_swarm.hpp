/// The swarm of the demo: its robots and the configurations of their daemons.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "config/schema/config.hpp"
#include "drivers/dataset/robot_clock.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// One robot of the demo: the configuration of its daemon, and its clock.
struct DemoRobot {
  Config config;
  RobotClock clock;  ///< against world time
};

/// Configurations for all `ids` in one world that began at `epoch_s` on the machine's clock. Robot
/// i serves poses at `first_port + i`; all talk to each other over loopback at `mesh_port`.
[[nodiscard]] std::vector<DemoRobot> demo_swarm(const SimConfig& world,
                                                const std::vector<RobotId>& ids, double epoch_s,
                                                std::uint16_t first_port, std::uint16_t mesh_port);

}  // namespace crepes
