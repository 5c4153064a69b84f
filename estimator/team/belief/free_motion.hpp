/// Motions of bodies in a frame that falls freely, and how one depends on another.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace crepes {

/// Position, velocity and attitude of a body in an inertial frame F that falls freely: there the
/// acceleration is the specific force, and gravity has no part in it. Errors are [p, v, theta] in
/// F, theta a right perturbation.
struct FreeMotion {
  static constexpr int kErrors = 9;

  Eigen::Vector3d p_F = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_F = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_F_B = Eigen::Quaterniond::Identity();

  [[nodiscard]] Eigen::Matrix3d R() const { return q_F_B.toRotationMatrix(); }
};

using MotionVector = Eigen::Matrix<double, FreeMotion::kErrors, 1>;
using MotionMatrix = Eigen::Matrix<double, FreeMotion::kErrors, FreeMotion::kErrors>;

/// The derivative of a motion by the one that it was `dt` seconds before. Whatever moves the body,
/// as the body feels it,
///   dp = dp0 + dt dv0 - [p - p0 - dt v0]x R0 dtheta0,
///   dv = dv0 - [v - v0]x R0 dtheta0,  dtheta = R^T R0 dtheta0.
[[nodiscard]] MotionMatrix by_earlier(const FreeMotion& earlier, const FreeMotion& motion,
                                      double dt);

/// A motion in the frame that falls freely with another body, the root.
struct RootedMotion {
  FreeMotion motion;
  MotionMatrix by_motion;  ///< derivative by the motion that it was
  MotionMatrix by_root;    ///< and by the root's
  MotionVector by_ahead;   ///< and by how far its clock is ahead of the root's
};

/// Of a body whose clock is ahead of the root's by tau, so that it is there tau before the root is:
///   p' = R_R^T (p - p_R + tau v_R),  v' = R_R^T (v - v_R),  R' = R_R^T R,
/// with errors
///   dp' = R_R^T (dp - dp_R + tau dv_R + v_R dtau) + [p']x dtheta_R,
///   dv' = R_R^T (dv - dv_R) + [v']x dtheta_R,  dtheta' = dtheta - R'^T dtheta_R.
[[nodiscard]] RootedMotion rooted(const FreeMotion& motion, const FreeMotion& root, double ahead_s);

}  // namespace crepes
