/// Whether a robot's own LED board blinks what the swarm expects of it.
#pragma once

#include <string>

#include "daemon/ctl/live/check/robot_check.hpp"
#include "firmware/protocol/led_messages.h"

namespace crepes {

/// The board's settings against those of the member with id `self`. Pure.
[[nodiscard]] CheckFinding judge_own_board(const led_settings& board, const SwarmConfig& swarm,
                                           RobotId self, const std::string& port);

/// Asks the board at a serial line.
[[nodiscard]] CheckFinding check_own_board(const std::string& port, const SwarmConfig& swarm,
                                           RobotId self);

}  // namespace crepes
