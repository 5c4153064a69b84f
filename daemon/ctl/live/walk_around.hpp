/// The guided part of `crepesctl check`: somebody carries a neighbor around, and says where it is.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "daemon/ctl/live/check/robot_check.hpp"

namespace crepes {

/// Where the neighbor is put.
enum class WalkStep : std::uint8_t {
  kAhead,       ///< both upright on a level floor, a taped distance apart
  kLeft,        ///< in front, to the left
  kRight,       ///< in front, to the right
  kLifted,      ///< higher than the observer
  kUpsideDown,  ///< turned over
};
inline constexpr std::array kWalkSteps{WalkStep::kAhead, WalkStep::kLeft, WalkStep::kRight,
                                       WalkStep::kLifted, WalkStep::kUpsideDown};

/// What to do with the neighbor, as an order to somebody beside it.
[[nodiscard]] std::string instruction_of(WalkStep step, const std::string& neighbor,
                                         std::optional<double> distance_m);

/// Whether the pose is where the neighbor was put. `distance_m` is from origin to origin. Pure.
[[nodiscard]] std::vector<CheckFinding> judge_walk(WalkStep step, const client::Pose& pose,
                                                   std::optional<double> distance_m);

/// The newest pose of the neighbor; empty if there is none.
using PoseNow = std::function<std::optional<client::Pose>()>;

/// All steps, one after the other: writes the instruction to `out` and waits for a line on `in`; a
/// line with s skips the step, the end of the input ends the walk.
[[nodiscard]] std::vector<CheckFinding> walk_around(const std::string& neighbor,
                                                    std::optional<double> distance_m,
                                                    const PoseNow& pose_now, std::istream& in,
                                                    std::ostream& out);

}  // namespace crepes
