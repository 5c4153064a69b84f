/// Poses of a robot on an arc: at a known place in its neighbor's axes, with an open heading.
#pragma once

#include "estimator/core/pose.hpp"

namespace crepes {

/// u . (theta x (theta x arm)) as a quadratic form in theta: what a turn of an arm adds along u to
/// second order, twice.
[[nodiscard]] Eigen::Matrix3d turned_twice(const Eigen::Vector3d& u, const Eigen::Vector3d& arm);

/// T_B_A of T_A_B to second order. Where B's place in A's axes is known better than its attitude, A
/// is on an arc about B, and `inverse` has the arc's tangent only. The mean of the arc is inside of
/// it, and its covariance there is twice that of a Gaussian angle: what an angle's square adds has
/// a longer tail than a Gaussian (0.3 % of all arcs would be beyond 5 sigma, so it is 0.08 %).
[[nodiscard]] GaussianPose inverse_on_arc(const GaussianPose& T_A_B);

}  // namespace crepes
