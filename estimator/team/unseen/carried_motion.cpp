#include "estimator/team/unseen/carried_motion.hpp"

#include "estimator/core/so3.hpp"

namespace crepes {

CarriedMotion CarriedMotion::followed_by(const FreeMotionAt& piece) const {
  CarriedMotion next{.t_s = t_s + piece.t_s, .motion = piece.motion};
  const MotionMatrix by_motion = by_earlier(motion, piece.motion, piece.t_s);
  next.by_errors = by_motion.lazyProduct(by_errors);
  next.by_errors += piece.by_bias;
  const MotionMatrix carried = by_motion.lazyProduct(noise);
  next.noise = carried.lazyProduct(by_motion.transpose());
  next.noise += piece.noise;
  return next;
}

CarriedMotion CarriedMotion::started_at(const FreeMotion& start, const ImuErrors& errors) const {
  const MotionVector step = by_errors * errors;
  const Eigen::Matrix3d R = start.R();
  const Eigen::Vector3d p = motion.p_F + step.head<3>();
  const Eigen::Vector3d v = motion.v_F + step.segment<3>(3);
  const Eigen::Quaterniond q = motion.q_F_B * so3_exp(step.tail<3>());
  CarriedMotion carried{.t_s = t_s,
                        .motion = {start.p_F + t_s * start.v_F + R * p, start.v_F + R * v,
                                   (start.q_F_B * q).normalized()}};
  MotionMatrix turn = MotionMatrix::Identity();
  turn.block<3, 3>(0, 0) = R;
  turn.block<3, 3>(3, 3) = R;
  carried.by_errors = turn.lazyProduct(by_errors);
  const MotionMatrix turned = turn.lazyProduct(noise);
  carried.noise = turned.lazyProduct(turn.transpose());
  return carried;
}

}  // namespace crepes
