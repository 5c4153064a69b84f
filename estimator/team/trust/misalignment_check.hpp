/// Whether what was measured of a camera's misalignment contradicts its prior.
#pragma once

#include <Eigen/Core>

#include "estimator/team/belief/team_belief.hpp"

namespace crepes {

/// The result for one camera.
struct MisalignmentCheck {
  double chi2 = 0.0;  ///< of three degrees of freedom, if the camera is as it was calibrated
  /// Its significant components, in the body's axes. Their length is arbitrary; zero: none.
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();
};

/// `camera` is one of the belief's.
[[nodiscard]] MisalignmentCheck misalignment_check(const TeamBelief& belief,
                                                   const TeamCamera& camera, const Priors& priors);

/// Of a camera that is turned about this axis, in the body's axes [rad^2]. The axis' length does
/// not matter; zero: any.
[[nodiscard]] Eigen::Matrix3d turned_covariance(const Eigen::Vector3d& axis);

}  // namespace crepes
