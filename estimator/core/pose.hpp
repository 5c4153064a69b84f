/// Rigid transforms, alone and with a covariance.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "estimator/core/so3.hpp"

namespace crepes {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// T_A_B: the pose of frame B in frame A; maps coordinates,  p_A = T_A_B * p_B.
struct Pose {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();            ///< origin of B in A [m]
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();  ///< attitude of B in A (Hamilton)

  [[nodiscard]] Eigen::Matrix3d R() const { return q.toRotationMatrix(); }

  [[nodiscard]] Pose inverse() const {
    const Eigen::Quaterniond q_inv = q.conjugate();
    return {-(q_inv * p), q_inv};
  }

  /// The same numbers: q and -q differ.
  [[nodiscard]] bool operator==(const Pose& other) const {
    return p == other.p && q.coeffs() == other.q.coeffs();
  }
};

[[nodiscard]] inline Eigen::Vector3d operator*(const Pose& T_A_B, const Eigen::Vector3d& p_B) {
  return T_A_B.q * p_B + T_A_B.p;
}

[[nodiscard]] inline Pose operator*(const Pose& T_A_B, const Pose& T_B_C) {
  return {T_A_B * T_B_C.p, (T_A_B.q * T_B_C.q).normalized()};
}

/// Pose with uncertainty. Error order [p, theta]:  p_true = p + dp  in A's axes,
/// R_true = R Exp(dtheta)  in B's axes.
struct GaussianPose {
  Pose pose;
  Matrix6d covariance = Matrix6d::Zero();
};

/// T_B_A of T_A_B:  dp' = -R^T dp + [p']x dtheta,  dtheta' = -R dtheta.
[[nodiscard]] inline GaussianPose inverse(const GaussianPose& T_A_B) {
  const Pose T_B_A = T_A_B.pose.inverse();
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = -T_B_A.R();
  J.topRightCorner<3, 3>() = hat(T_B_A.p);
  J.bottomRightCorner<3, 3>() = -T_A_B.pose.R();
  return {T_B_A, J * T_A_B.covariance * J.transpose()};
}

/// T_A_C, for independent errors:  dp = dp1 - R1 [p2]x dtheta1 + R1 dp2,
/// dtheta = R2^T dtheta1 + dtheta2.
[[nodiscard]] inline GaussianPose operator*(const GaussianPose& T_A_B, const GaussianPose& T_B_C) {
  Matrix6d J_first = Matrix6d::Identity();
  J_first.topRightCorner<3, 3>() = -T_A_B.pose.R() * hat(T_B_C.pose.p);
  J_first.bottomRightCorner<3, 3>() = T_B_C.pose.R().transpose();
  Matrix6d J_second = Matrix6d::Identity();
  J_second.topLeftCorner<3, 3>() = T_A_B.pose.R();
  return {T_A_B.pose * T_B_C.pose, J_first * T_A_B.covariance * J_first.transpose() +
                                       J_second * T_B_C.covariance * J_second.transpose()};
}

/// The perturbation d from `from` to `to`, in GaussianPose's error convention.
[[nodiscard]] inline Vector6d pose_difference(const Pose& from, const Pose& to) {
  Vector6d d;
  d << to.p - from.p, so3_log(from.q.conjugate() * to.q);
  return d;
}

/// `pose` moved by `d`, in GaussianPose's error convention.
[[nodiscard]] inline Pose perturbed(const Pose& pose, const Vector6d& d) {
  return {pose.p + d.head<3>(), (pose.q * so3_exp(d.tail<3>())).normalized()};
}

}  // namespace crepes
