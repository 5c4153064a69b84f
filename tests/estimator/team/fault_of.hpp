/// The fault that a team's filter finds with a robot; null if none.
#pragma once

#include <algorithm>

#include "estimator/team/team_filter.hpp"

namespace crepes::test {

inline const TeamFault* fault_of(const TeamSolution& solution, RobotId robot) {
  const auto found = std::ranges::find(solution.faults, robot, &TeamFault::robot);
  return found == solution.faults.end() ? nullptr : &*found;
}

}  // namespace crepes::test
