#include "estimator/team/keyframe_pose.hpp"

#include <algorithm>
#include <array>

#include "estimator/core/so3.hpp"

namespace crepes {

TeamPose keyframe_pose(const TeamBelief& belief, const TeamArcs& arcs, RobotId id,
                       const TeamMember& member) {
  constexpr int kStates = TeamPose::kMotion;
  const TeamRobot& robot = belief.robots.at(id);
  const Eigen::MatrixXd& P = belief.P;
  const double tau = robot.clock_s;
  const ImuMean& last = member.imu.back();
  const Eigen::Vector3d w =
      without_errors(last.gyro_radps, robot.bias.gyro_radps, robot.bias.gyro_scale);
  const Eigen::Vector3d a = robot.motion.q_F_B * (last.accel_mps2 - robot.bias.accel_mps2);
  const Eigen::Vector3d v = robot.motion.v_F + tau * a;

  // Of [motion, biases of this robot and of the other], by the states and the clock.
  constexpr int kBiases = TeamPose::kBiases;
  MotionMatrix by_motion = MotionMatrix::Identity();
  by_motion.block<3, 3>(0, 3).diagonal().setConstant(tau);
  by_motion.block<3, 3>(6, 6) = so3_exp(-tau * w).toRotationMatrix();
  MotionVector by_clock;
  by_clock << v, a, w;
  const int motion = robot.motion_index;
  const int clock = robot.clock_index();
  const std::array<int, 2> biases{belief.robots.at(belief.self).bias_index, robot.bias_index};
  const auto of_biases = [&](Eigen::Index row) {
    Eigen::Matrix<double, 1, kBiases> covariance;
    covariance << P.block<1, 6>(row, biases[0]), P.block<1, 6>(row, biases[1]);
    return covariance;
  };
  const MotionVector with_clock = by_motion * P.block<kStates, 1>(motion, clock);
  const MotionMatrix carried = by_motion.lazyProduct(P.block<kStates, kStates>(motion, motion));
  MotionMatrix of_motion = carried.lazyProduct(by_motion.transpose());
  of_motion += with_clock * by_clock.transpose() + by_clock * with_clock.transpose() +
               P(clock, clock) * by_clock * by_clock.transpose();
  Eigen::Matrix<double, kStates, kBiases> with_biases;
  for (int i = 0; i < kStates; ++i) with_biases.row(i) = of_biases(motion + i);
  with_biases = (by_motion * with_biases + by_clock * of_biases(clock)).eval();

  TeamPose pose{.neighbor = id,
                .T_B_N = {robot.motion.p_F + tau * robot.motion.v_F + 0.5 * tau * tau * a,
                          (robot.motion.q_F_B * so3_exp(tau * w)).normalized()},
                .v_B_N = v,
                .last_sighting = std::max(robot.last_sighting, robot.last_fix),
                .since = robot.since,
                .clock_ahead = from_seconds(tau)};
  pose.covariance.topLeftCorner<kStates, kStates>() = 0.5 * (of_motion + of_motion.transpose());
  pose.covariance.topRightCorner<kStates, kBiases>() = with_biases;
  pose.covariance.bottomLeftCorner<kBiases, kStates>() = with_biases.transpose();
  for (int i = 0; i < kBiases; ++i) {
    pose.covariance.bottomRightCorner<kBiases, kBiases>().row(i) =
        of_biases(biases.at(static_cast<std::size_t>(i / 6)) + i % 6);
  }
  const Bend bend = arcs.bend(belief, id);
  pose.T_B_N.p += bend.mean.head<3>();
  pose.v_B_N += bend.mean.tail<3>();
  pose.covariance.topLeftCorner<6, 6>() += bend.covariance;
  return pose;
}

}  // namespace crepes
