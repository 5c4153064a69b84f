#include "estimator/team/belief/frame_change.hpp"

#include <iterator>
#include <vector>

#include "estimator/core/so3.hpp"
#include "estimator/team/belief/motion_image.hpp"

namespace crepes {
namespace {

constexpr int kMotionStates = FreeMotionAt::kMotion;  // [p, v, theta]
using MotionMatrix = Eigen::Matrix<double, kMotionStates, kMotionStates>;
using MotionVector = Eigen::Matrix<double, kMotionStates, 1>;

/// How a robot's errors at the next keyframe follow from those at the last one.
struct Moved {
  int index = 0;
  MotionImage image{};
  MotionMatrix by_self{};  ///< by this robot's motion at the end
  MotionMatrix noise{};
};

/// With S this robot at the end of the interval, the new frame's motions are
///   p' = R_S^T (p - p_S + tau v_S),  v' = R_S^T (v - v_S),  R' = R_S^T R,
/// because the robot is there tau before the new frame begins, and their errors
///   dp' = R_S^T (dp - dp_S + tau dv_S + v_S dtau) + [p']x dtheta_S,
///   dv' = R_S^T (dv - dv_S) + [v']x dtheta_S,  dtheta' = dtheta - R'^T dtheta_S.
/// `robot` receives the new motion.
Moved moved(const FreeMotionAt& end, const FreeMotionAt& self, int self_bias, TeamRobot& robot) {
  const Eigen::Matrix3d R_S_F = self.motion.R().transpose();
  FreeMotion& next = robot.motion;
  next.p_F = R_S_F * (end.motion.p_F - self.motion.p_F + robot.clock_s * self.motion.v_F);
  next.v_F = R_S_F * (end.motion.v_F - self.motion.v_F);
  next.q_F_B = (self.motion.q_F_B.conjugate() * end.motion.q_F_B).normalized();
  Moved moved{.index = robot.motion_index};
  moved.by_self.setZero();
  moved.by_self.block<3, 3>(0, 0) = -R_S_F;
  moved.by_self.block<3, 3>(0, 3) = robot.clock_s * R_S_F;
  moved.by_self.block<3, 3>(3, 3) = -R_S_F;
  moved.by_self.block<3, 3>(0, 6) = hat(next.p_F);
  moved.by_self.block<3, 3>(3, 6) = hat(next.v_F);
  moved.by_self.block<3, 3>(6, 6) = -next.R().transpose();
  MotionMatrix turn = MotionMatrix::Identity();
  turn.block<3, 3>(0, 0) = R_S_F;
  turn.block<3, 3>(3, 3) = R_S_F;
  MotionVector by_clock = MotionVector::Zero();
  by_clock.head<3>() = R_S_F * self.motion.v_F;
  moved.image.parts = {
      {robot.motion_index, turn.lazyProduct(end.by_start.leftCols<kMotionStates>())},
      {robot.bias_index, turn.lazyProduct(end.by_start.rightCols<FreeMotionAt::kBias>())},
      {self_bias, moved.by_self.lazyProduct(self.by_start.rightCols<FreeMotionAt::kBias>())},
      {robot.clock_index(), by_clock}};
  const MotionMatrix turned = turn.lazyProduct(end.noise);
  moved.noise = turned.lazyProduct(turn.transpose());
  return moved;
}

/// The covariance at the next keyframe. `self_noise` is what this robot's IMU has added.
void carry(const std::vector<Moved>& all, const MotionMatrix& self_noise, Eigen::MatrixXd& P) {
  std::vector<MotionImage> images;
  images.reserve(all.size());
  for (const Moved& m : all) images.push_back(m.image);
  const Eigen::Index count = kMotionStates * std::ssize(all);
  Eigen::MatrixXd with_all(P.rows(), count);
  set_covariance_with(images, P, with_all);
  Eigen::MatrixXd own(count, count);
  set_covariance_of(images, with_all, own);
  const auto first = [](std::size_t i) { return kMotionStates * static_cast<Eigen::Index>(i); };
  for (std::size_t a = 0; a < all.size(); ++a) {
    P.middleCols<kMotionStates>(all[a].index) = with_all.middleCols<kMotionStates>(first(a));
    P.middleRows<kMotionStates>(all[a].index) =
        with_all.middleCols<kMotionStates>(first(a)).transpose();
  }
  for (std::size_t a = 0; a < all.size(); ++a) {
    const MotionMatrix of_self = all[a].by_self.lazyProduct(self_noise);
    for (std::size_t b = 0; b <= a; ++b) {
      MotionMatrix block = own.block<kMotionStates, kMotionStates>(first(a), first(b));
      block += of_self.lazyProduct(all[b].by_self.transpose());
      if (a == b) {
        block += all[a].noise;
        block = (0.5 * (block + block.transpose())).eval();
      }
      P.block<kMotionStates, kMotionStates>(all[b].index, all[a].index) = block.transpose();
      P.block<kMotionStates, kMotionStates>(all[a].index, all[b].index) = block;
    }
  }
}

}  // namespace

void change_frame(const TeamTrajectories& paths, TeamBelief& belief) {
  const FreeMotionAt& end_of_self = paths.at(belief.self).end();
  const int self_bias = belief.robots.at(belief.self).bias_index;
  std::vector<Moved> all;
  for (auto& [id, robot] : belief.robots) {
    if (robot.motion_index >= 0)
      all.push_back(moved(paths.at(id).end(), end_of_self, self_bias, robot));
  }
  carry(all, end_of_self.noise, belief.P);
}

}  // namespace crepes
