/// Corrections of the relative motion in polar coordinates, in which bearings are linear.
///
/// A bearing observes the direction of N and nothing of its distance. In Cartesian coordinates this
/// holds only at the direction of one linearization: each correction rotates the line of sight by
/// some noise, the next bearing is linearized elsewhere, and together they seem to have observed
/// the distance. So corrections act, and covariances persist, in modified polar coordinates (Aidala
/// and Hammel 1983), an instance of an observability-constrained filter (Huang, Mourikis,
/// Roumeliotis 2010):
///
///     u           direction of N in B's axes          p = rho u
///     ln rho      logarithm of its distance
///     q           velocity over distance, in axes that turn with the line of sight: v = rho Q q
///     R^T u       direction of B in N's axes, and N's roll about the line of sight
///
/// The error state itself stays Cartesian.
#pragma once

#include "estimator/relative/error_state.hpp"

namespace crepes {

/// [p, v, theta] of ErrorState.
using MotionError = Eigen::Matrix<double, ErrorState::kMotion, 1>;
using MotionTransport = Eigen::Matrix<double, ErrorState::kMotion, ErrorState::kMotion>;

/// `motion` corrected by `dx`, which is added in polar coordinates; equal to an addition to first
/// order. The distance shrinks to a tenth at most. At a distance of zero, `dx` is added.
[[nodiscard]] RelativeMotion corrected(const RelativeMotion& motion, const MotionError& dx);

/// The errors at `after` by those at `before` that are equal in polar coordinates. The identity if
/// one of the distances is zero.
[[nodiscard]] MotionTransport error_transport(const RelativeMotion& before,
                                              const RelativeMotion& after);

/// Likewise if N has never seen B. Gravity ties N's attitude then, and its error stays as it is:
/// how N would see B is not known, and to keep that would make N's turn about the vertical seem
/// measured.
[[nodiscard]] MotionTransport error_transport_of_blind(const RelativeMotion& before,
                                                       const RelativeMotion& after);

}  // namespace crepes
