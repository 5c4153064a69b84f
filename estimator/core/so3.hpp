/// Rotations: exponential, logarithm and their Jacobians (Sola, Deray, Atchuthan 2018, "A micro Lie
/// theory for state estimation in robotics", appendix B).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace crepes {

/// [v]x : the matrix with  hat(v) * w = v x w.
[[nodiscard]] Eigen::Matrix3d hat(const Eigen::Vector3d& v);

/// Exp: rotation vector [rad] -> unit quaternion.
[[nodiscard]] Eigen::Quaterniond so3_exp(const Eigen::Vector3d& theta);

/// Log: unit quaternion -> rotation vector [rad], of length at most pi.
[[nodiscard]] Eigen::Vector3d so3_log(const Eigen::Quaterniond& q);

/// J_r(theta):  Exp(theta + d) = Exp(theta) Exp(J_r d)  to first order in d.
[[nodiscard]] Eigen::Matrix3d so3_right_jacobian(const Eigen::Vector3d& theta);

/// J_r^-1(theta):  Log(R Exp(d)) = Log(R) + J_r^-1(Log R) d  to first order in d.
[[nodiscard]] Eigen::Matrix3d so3_right_jacobian_inverse(const Eigen::Vector3d& theta);

/// The shortest rotation that turns `from` into the direction of `to`. Both are nonzero. Between
/// opposite directions it is a half turn about one of the axes across.
[[nodiscard]] Eigen::Quaterniond shortest_rotation(const Eigen::Vector3d& from,
                                                   const Eigen::Vector3d& to);

/// The angle between two directions [rad], also where it is small or almost pi.
[[nodiscard]] double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

/// Roll, pitch and yaw of `q` [rad]: the angles about x, y and z of R = Rz Ry Rx.
[[nodiscard]] Eigen::Vector3d roll_pitch_yaw_of(const Eigen::Quaterniond& q);

/// Two unit vectors that complete the unit vector `u` to a right-handed orthonormal basis
/// (columns), a smooth function of u almost everywhere (Duff et al. 2017).
[[nodiscard]] Eigen::Matrix<double, 3, 2> tangent_basis(const Eigen::Vector3d& u);

/// The log of the shortest rotation between two directions, in the plane across the first: the
/// components of `u` along `across`, stretched to the angle [rad]. So nothing is flattened where
/// the angle is large. `predicted` and `u` are unit vectors with the same axes, and `across` is
/// `tangent_basis(predicted)`.
[[nodiscard]] Eigen::Vector2d angles_across(const Eigen::Vector3d& predicted,
                                            const Eigen::Matrix<double, 3, 2>& across,
                                            const Eigen::Vector3d& u);

}  // namespace crepes
