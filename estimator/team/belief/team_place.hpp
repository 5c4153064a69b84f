/// Where a robot is relative to this one, by a chain of estimates.
#pragma once

#include "estimator/team/belief/team_belief.hpp"

namespace crepes {

/// A pose and a velocity with their errors.
struct TeamPlace {
  Pose T_S_N;
  Eigen::Vector3d v_S_N = Eigen::Vector3d::Zero();
  MotionMatrix covariance = MotionMatrix::Zero();  ///< of [p, v, theta]
  Timestamp last_sighting = kNever;                ///< the earliest along the chain
  Timestamp last_fix = kNever;                     ///< by ranges alone, likewise
  /// The robot before it in the chain, RobotId{} if there is none, and how its errors act here. The
  /// rest of the covariance is the last step's own.
  RobotId via{};
  MotionMatrix by_via = MotionMatrix::Zero();
  MotionMatrix of_step = MotionMatrix::Zero();

  /// Of a robot in the belief.
  [[nodiscard]] static TeamPlace of(const TeamBelief& belief, RobotId id);
  /// Of a robot that is estimated at `step` from here, where `id` is.
  [[nodiscard]] TeamPlace beyond(RobotId id, const GaussianPose& step,
                                 const Eigen::Vector3d& v_step, Timestamp estimated) const;
  /// For comparison: the smaller, the better is the place known.
  [[nodiscard]] double doubt() const;
  /// The pose of a robot of whose IMU nothing is known.
  [[nodiscard]] TeamPose pose(RobotId id, const TeamBelief& belief, const Priors& priors) const;
};

}  // namespace crepes
