#include "estimator/team/unseen/carried_motion.hpp"

#include "estimator/core/so3.hpp"

namespace crepes {

CarriedMotion CarriedMotion::followed_by(const FreeMotionAt& piece) const {
  CarriedMotion next{.t_s = t_s + piece.t_s, .motion = piece.motion};
  const Covariance by_motion = piece.by_start.leftCols<kMotion>();
  next.by_start = by_motion.lazyProduct(by_start);
  next.by_start.rightCols<kErrors>() += piece.by_start.rightCols<kErrors>();
  const Covariance carried = by_motion.lazyProduct(noise);
  next.noise = carried.lazyProduct(by_motion.transpose());
  next.noise += piece.noise;
  return next;
}

CarriedMotion CarriedMotion::started_at(const FreeMotion& start, const ImuErrors& errors) const {
  const Eigen::Matrix<double, kMotion, kErrors> by_errors = by_start.rightCols<kErrors>();
  const Eigen::Matrix<double, kMotion, 1> step = by_errors * errors;
  const Eigen::Matrix3d R = start.R();
  const Eigen::Vector3d p = motion.p_F + step.head<3>();
  const Eigen::Vector3d v = motion.v_F + step.segment<3>(3);
  const Eigen::Quaterniond q = motion.q_F_B * so3_exp(step.tail<3>());
  CarriedMotion carried{.t_s = t_s,
                        .motion = {start.p_F + t_s * start.v_F + R * p, start.v_F + R * v,
                                   (start.q_F_B * q).normalized()}};
  Covariance turn = Covariance::Identity();
  turn.block<3, 3>(0, 0) = R;
  turn.block<3, 3>(3, 3) = R;
  carried.by_start.block<3, 3>(0, 3) = t_s * Eigen::Matrix3d::Identity();
  carried.by_start.block<3, 3>(0, 6) = -R * hat(p);
  carried.by_start.block<3, 3>(3, 6) = -R * hat(v);
  carried.by_start.block<3, 3>(6, 6) = q.conjugate().toRotationMatrix();
  carried.by_start.rightCols<kErrors>() = turn.lazyProduct(by_errors);
  const Covariance turned = turn.lazyProduct(noise);
  carried.noise = turned.lazyProduct(turn.transpose());
  return carried;
}

}  // namespace crepes
