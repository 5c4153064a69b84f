/// What the team's filter and a pair's know of the robots' sensors, as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string_view>

#include "estimator/core/outputs.hpp"
#include "net/subscription/json_parts.hpp"

namespace crepes {

/// Trust, mean NIS by kind, faults; in full also counts and the calibration. `self` is the robot
/// whose clock all others are compared with.
enum class TeamDetail : std::uint8_t { kBrief, kFull };
[[nodiscard]] OrderedJson team_robot_json(const TeamRobotStatus& robot, std::string_view name,
                                          RobotId self, TeamDetail detail);

/// Residuals by kind and calibration of a neighbor's filter.
[[nodiscard]] OrderedJson pair_filter_json(const NeighborStatus& neighbor);

}  // namespace crepes
