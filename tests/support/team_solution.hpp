/// What a team's filter says of a SimulatedTeam, and how far that is from the truth.
#pragma once

#include <algorithm>

#include "estimator/team/team_filter.hpp"
#include "tests/support/simulated_team.hpp"

namespace crepes::test {

inline constexpr double kProbation =
    1.5;  // s; longer than robots are on probation, and some intervals

inline const TeamPose* find(const TeamSolution& solution, RobotId robot) {
  const auto found = std::ranges::find(solution.poses, robot, &TeamPose::neighbor);
  return found == solution.poses.end() ? nullptr : &*found;
}

inline Vector6d error_of(const TeamPose& pose, const Pose& truth) {
  return pose_difference(pose.T_B_N, truth);
}

inline double nees_of(const TeamPose& pose, const Pose& truth) {
  const Vector6d e = error_of(pose, truth);
  return e.dot(pose.pose_covariance().llt().solve(e));
}

inline double position_nees_of(const TeamPose& pose, const Pose& truth) {
  const Eigen::Vector3d e = error_of(pose, truth).head<3>();
  return e.dot(pose.covariance.topLeftCorner<3, 3>().llt().solve(e));
}

/// How well the angle of its first camera is known [rad]; 1 if it has none.
inline double camera_sigma_rad(const TeamSolution& solution, RobotId robot) {
  const auto found = std::ranges::find(solution.calibrations, robot, &RobotCalibration::robot);
  if (found == solution.calibrations.end() || found->cameras.empty()) return 1.0;
  return found->cameras.front().angle_sigma_rad();
}

inline TeamSolution solution_after(SimulatedTeam& team, TeamFilter& filter, double seconds) {
  TeamSolution solution;
  for (double t = 0.0; t < seconds; t += kIntervalSeconds) solution = filter.step(team.next());
  return solution;
}

}  // namespace crepes::test
