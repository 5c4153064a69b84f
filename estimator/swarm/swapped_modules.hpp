/// Finds robots that carry another robot's UWB module.
#pragma once

#include <map>
#include <optional>

#include "estimator/core/measurements.hpp"
#include "estimator/core/team_solution.hpp"

namespace crepes {

/// A module measures no distance to itself. So if a robot reports ranges to its own id, another
/// robot carries the module of that id, and all ranges to it end at that other robot. Its own
/// ranges to others are right, whichever module it carries.
class SwappedModules {
 public:
  /// Any range, of any robot, whether it is used or not.
  void add(RobotId observer, const UwbRange& range);
  /// Whether ranges to this robot end at another one; `now` is the stamp of such a range.
  [[nodiscard]] bool contains(RobotId robot, Timestamp now) const;
  /// Empty if it carries its own, as far as is known.
  [[nodiscard]] std::optional<TeamFault> fault_of(RobotId robot, Timestamp now) const;

 private:
  /// Ranges to its own id, of one robot.
  struct Evidence {
    int ranges = 0;
    Timestamp last = kNever;
    double range_m = 0.0;  ///< the latest, to where the module of that id is
  };
  std::map<RobotId, Evidence> evidence_;  ///< of members alone
};

}  // namespace crepes
