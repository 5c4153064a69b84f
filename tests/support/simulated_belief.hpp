/// A belief about a simulated team, without the filter that would have found it.
#pragma once

#include <algorithm>

#include "estimator/team/belief/team_belief.hpp"
#include "tests/support/simulated_team.hpp"

namespace crepes::test {

using TrueMotions = std::map<RobotId, FreeMotion>;

inline TrueMotions motions_of(const SimulatedTeam& team) {
  TrueMotions motions;
  for (const RobotId robot : team.robots()) motions[robot] = team.true_motion(robot);
  return motions;
}

/// Where all robots are when the interval begins, known to 5 cm, 1 deg and 5 cm/s; all are trusted.
inline TeamBelief true_belief(const TrueMotions& at_beginning, const TeamInterval& next) {
  TeamBelief belief = TeamBelief::beginning(next);
  for (const TeamMember& member : next.members) {
    TeamRobot& robot = belief.robots[member.robot];
    robot.is_trusted = true;
    robot.since = robot.last_sighting = next.from;
    if (member.robot != kSelf) {
      robot.motion = at_beginning.at(member.robot);
      robot.motion_index = belief.append(FreeMotionAt::kMotion, 0.05);
      belief.P.diagonal().tail<3>().setConstant(radians(1.0) * radians(1.0));
      robot.bias_index = belief.append_calibration(next.settings.priors);
    }
  }
  for (const TeamBearing& reading : next.bearings) {
    auto& cameras = belief.robots.at(reading.observer).cameras;
    if (std::ranges::find(cameras, reading.bearing.p_B_C, &TeamCamera::p_B_C) == cameras.end()) {
      cameras.push_back({.p_B_C = reading.bearing.p_B_C,
                         .index = belief.append(3, next.settings.priors.misalignment_rad)});
      belief.append(3, next.settings.priors.lens_rad);
    }
  }
  belief.append_range_biases(next);
  return belief;
}

}  // namespace crepes::test
