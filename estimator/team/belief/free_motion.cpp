#include "estimator/team/belief/free_motion.hpp"

#include "estimator/core/so3.hpp"

namespace crepes {

MotionMatrix by_earlier(const FreeMotion& earlier, const FreeMotion& motion, double dt) {
  const Eigen::Matrix3d R_F_B = earlier.R();
  MotionMatrix by = MotionMatrix::Identity();
  by.block<3, 3>(0, 3).diagonal().setConstant(dt);
  by.block<3, 3>(0, 6) = -hat(motion.p_F - earlier.p_F - dt * earlier.v_F) * R_F_B;
  by.block<3, 3>(3, 6) = -hat(motion.v_F - earlier.v_F) * R_F_B;
  by.block<3, 3>(6, 6) = motion.R().transpose() * R_F_B;
  return by;
}

RootedMotion rooted(const FreeMotion& motion, const FreeMotion& root, double ahead_s) {
  const Eigen::Matrix3d R_R_F = root.R().transpose();
  RootedMotion result{.motion = {R_R_F * (motion.p_F - root.p_F + ahead_s * root.v_F),
                                 R_R_F * (motion.v_F - root.v_F),
                                 (root.q_F_B.conjugate() * motion.q_F_B).normalized()},
                      .by_motion = MotionMatrix::Identity(),
                      .by_root = MotionMatrix::Zero(),
                      .by_ahead = MotionVector::Zero()};
  result.by_motion.block<3, 3>(0, 0) = R_R_F;
  result.by_motion.block<3, 3>(3, 3) = R_R_F;
  result.by_root.block<3, 3>(0, 0) = -R_R_F;
  result.by_root.block<3, 3>(0, 3) = ahead_s * R_R_F;
  result.by_root.block<3, 3>(3, 3) = -R_R_F;
  result.by_root.block<3, 3>(0, 6) = hat(result.motion.p_F);
  result.by_root.block<3, 3>(3, 6) = hat(result.motion.v_F);
  result.by_root.block<3, 3>(6, 6) = -result.motion.R().transpose();
  result.by_ahead.head<3>() = R_R_F * root.v_F;
  return result;
}

}  // namespace crepes
