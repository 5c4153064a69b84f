/// What is right and wrong with a running robot, in the order in which one thing rests on another.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "daemon/ctl/live/check/findings.hpp"

namespace crepes {

/// All findings, section by section. Totals count only as far as they grew between the two states,
/// so that what is mended is forgotten. Pure.
[[nodiscard]] std::vector<CheckFinding> check_robot(const RobotObservation& seen);

/// The section about exposure alone.
[[nodiscard]] std::vector<CheckFinding> check_exposure(const client::Status& status);

/// Where the neighbors are, in words that somebody beside the robots can compare. Empty without
/// poses.
[[nodiscard]] std::string places_text(const std::map<RobotId, client::Pose>& poses);

}  // namespace crepes
