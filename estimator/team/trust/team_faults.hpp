/// What the team's filter reports of robots: their calibrations, and their faults.
#pragma once

#include <vector>

#include "estimator/team/belief/team_belief.hpp"

namespace crepes {

/// The prior of a misalignment's sigma [rad]. A configuration may claim to know it exactly: it is
/// not believed to be below 0.1 deg.
[[nodiscard]] double believed_misalignment(const Priors& priors);

/// Whether its misalignment is significant, and beyond what a calibration leaves.
[[nodiscard]] bool is_turned(const CameraMisalignment& camera, const Priors& priors);

/// The calibration of each robot.
[[nodiscard]] std::vector<RobotCalibration> calibrations_of(const TeamBelief& belief,
                                                            const Priors& priors);

/// Faults to report: cameras that are turned or refused, robots of which most ranges are refused,
/// and wrong clocks. `calibrations` are those of `belief`.
[[nodiscard]] std::vector<TeamFault> faults_of(const TeamBelief& belief,
                                               const std::vector<RobotCalibration>& calibrations);

}  // namespace crepes
