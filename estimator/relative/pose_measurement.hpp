/// A whole relative pose as one measurement, for example the pose graph's.
#pragma once

#include "estimator/relative/error_state.hpp"
#include "estimator/relative/kalman_update.hpp"

namespace crepes {

/// Linearizes  z = T_B_N  with the error convention of GaussianPose, which is the filter's own.
[[nodiscard]] inline Innovation<6, ErrorState::kSeen> linearize_pose(const NominalState& state,
                                                                     const GaussianPose& T_B_N) {
  Innovation<6, ErrorState::kSeen> z;
  z.residual = pose_difference(state.motion.T_B_N, T_B_N.pose);
  z.H.setZero();
  z.H.block<3, 3>(0, ErrorState::kP).setIdentity();
  z.H.block<3, 3>(3, ErrorState::kTheta) = so3_right_jacobian_inverse(-z.residual.tail<3>());
  z.cov_z = T_B_N.covariance;
  return z;
}

}  // namespace crepes
