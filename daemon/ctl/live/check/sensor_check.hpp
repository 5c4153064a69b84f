/// What is right and wrong with a robot's sensors, their rates and its pictures.
#pragma once

#include "daemon/ctl/live/check/findings.hpp"

namespace crepes {

/// Whether they work, and what they lost.
void check_sensors(const RobotObservation& seen, CheckSection section);
/// Whether they are as fast as configured, and the computer as fast as they are.
void check_rates(const RobotObservation& seen, CheckSection section);
/// Whether lights stand out from the background.
void check_exposure(const client::Status& status, CheckSection section);

}  // namespace crepes
