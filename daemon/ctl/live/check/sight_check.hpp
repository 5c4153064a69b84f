/// What is right and wrong with what robots see of each other, and with their calibration.
#pragma once

#include "daemon/ctl/live/check/findings.hpp"

namespace crepes {

/// Whether the neighbors see our board, and whether boards of other swarms are in view.
void check_board(const RobotObservation& seen, CheckSection section);
/// Whether measurements agree with the estimates, and what the team says.
void check_calibration(const RobotObservation& seen, CheckSection section);

}  // namespace crepes
