/// What bearings say of the distance.
///
/// A bearing observes the distance by parallax only: a motion across the line of sight, which the
/// IMUs measure in meters, turns it by an angle that depends on the distance. But the filter knows
/// that motion no better than the direction itself, and its own error looks like parallax. The same
/// error is in the innovation, with the opposite sign, so that their product does not average out
/// (errors in variables): robots at rest learn a wrong distance, the faster the less they know it.
///
/// So the part of a bearing's gain that acts on the distance, and on all that goes with it, shrinks
/// as the parallax does that is significant (James and Stein 1961). Without any, the distance is a
/// considered parameter (Schmidt 1966): it is not corrected, and its uncertainty counts.
#pragma once

#include <Eigen/Core>

#include "estimator/relative/bearing_measurement.hpp"
#include "estimator/relative/error_state.hpp"
#include "estimator/relative/kalman_update.hpp"

namespace crepes {

/// Withholds the correction of the distance from `outcome`, the gain of `z` from P, as far as the
/// parallax is not significant. Returns w: the covariance after the correction is P - G G^T + w
/// w^T, as Joseph's form gives it for the smaller gain. `p_B_N` is the neighbor's position.
[[nodiscard]] ErrorState::Vector withhold_distance(const BearingInnovation& z,
                                                   const Eigen::Vector3d& p_B_N,
                                                   const ErrorState::Covariance& P,
                                                   UpdateOutcome<2, ErrorState::kSize>& outcome);

/// P - G G^T + w w^T, symmetric to the bit.
void correct_covariance(const UpdateOutcome<2, ErrorState::kSize>& outcome,
                        const ErrorState::Vector& withheld, ErrorState::Covariance& P);

}  // namespace crepes
