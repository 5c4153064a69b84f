/// What the cameras and ranges of the team say of its robots' places and attitudes.
#pragma once

#include <functional>
#include <map>

#include "estimator/team/belief/team_belief.hpp"

namespace crepes {

/// How many cameras, or how many bearings of late, agree with a robot's place, and how many
/// contradict it.
struct Votes {
  double agree = 0.0;
  double contradict = 0.0;
};
/// Of each robot.
using Witnesses = std::map<RobotId, Votes>;

/// Whether a camera of this robot is no witness.
using IsExcluded = std::function<bool(RobotId, const TeamCamera&)>;

/// The cameras that see each robot. A camera that is refused or excluded is no witness.
[[nodiscard]] Witnesses witnesses_of(const TeamBelief& belief, const IsExcluded& is_excluded);
/// The bearings of each robot and to it.
[[nodiscard]] Witnesses bearings_of(const TeamBelief& belief);
/// The ranges of a robot and to it.
[[nodiscard]] Agreement ranges_of(const TeamBelief& belief, RobotId id);

/// Ranges that a robot's own module measured.
struct OwnRanges {
  int measured = 0;      ///< pairs
  int contradicted = 0;  ///< of these, pairs whose ranges are refused
  double sum_m = 0.0;    ///< by which those are too long, together

  /// Most of them, to two others or more.
  [[nodiscard]] bool are_false() const { return contradicted >= 2 && 2 * contradicted > measured; }
};
/// Of those pairs that count.
[[nodiscard]] OwnRanges own_ranges_of(const TeamBelief& belief, RobotId id,
                                      const std::function<bool(const RobotPair&)>& counts);

/// Whether a camera contradicts most of what it sees, and nobody contradicts the place of the robot
/// that carries it. If it was found turned before, it need only contradict robots that no other
/// camera contradicts, more often than it agrees with all others.
[[nodiscard]] bool looks_turned(const TeamBelief& belief, RobotId observer,
                                const TeamCamera& camera, bool was_turned);
/// Whether a camera agrees with nobody, and other cameras confirm the place of each robot that it
/// contradicts. So its own attitude is wrong, which no other camera can show.
[[nodiscard]] bool is_alone(const TeamBelief& belief, RobotId observer, const TeamCamera& camera);
/// Whether most of these witnesses contradict the robot's place. In a tie, it is the robot that
/// came last of all that are contradicted.
[[nodiscard]] bool is_contradicted(const TeamBelief& belief, const Witnesses& all, RobotId id);
/// Whether ranges contradict the robot's place, as a wrong place would let them: those that it
/// measured and those to it, to most of the others and to two at least.
[[nodiscard]] bool is_misplaced(const TeamBelief& belief, RobotId id);
/// Whether the robot's place agrees with the ranges that it measured, but not with those that
/// trusted robots measured to it. A trusted robot whose own ranges are false says nothing of that.
[[nodiscard]] bool is_placed_by_its_own_ranges(const TeamBelief& belief, RobotId id);

}  // namespace crepes
