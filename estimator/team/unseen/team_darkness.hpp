/// Robots that nobody sees, and whether ranges locate them.
#pragma once

#include <optional>
#include <set>

#include "estimator/team/belief/team_belief.hpp"
#include "estimator/team/belief/team_interval.hpp"

namespace crepes {

/// A robot is in the dark if nobody has seen it for a second. Ranges locate it if enough trusted
/// robots that are seen measure them in this interval, in different directions from it. Refers to
/// interval and belief, which must outlive it.
class TeamDarkness {
 public:
  TeamDarkness(const TeamInterval& interval, const TeamBelief& belief);

  /// Where everybody is seen, or the one that is not is located by ranges. Both are in the belief.
  [[nodiscard]] bool allows(const TeamRange& reading) const;
  /// If one of the two is in the dark, and the other is not.
  [[nodiscard]] std::optional<RobotId> dark_of(const TeamRange& reading) const;

 private:
  [[nodiscard]] bool is_dark(RobotId id) const;
  [[nodiscard]] bool is_located(RobotId dark, const std::set<RobotId>& beacons) const;

  const TeamInterval& interval_;
  const TeamBelief& belief_;
  std::set<RobotId> located_;
};

}  // namespace crepes
