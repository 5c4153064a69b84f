#include "estimator/team/belief/team_place.hpp"

#include <algorithm>

#include "estimator/core/so3.hpp"

namespace crepes {

TeamPlace TeamPlace::of(const TeamBelief& belief, RobotId id) {
  const TeamRobot& robot = belief.robots.at(id);
  TeamPlace place{.T_S_N = {robot.motion.p_F, robot.motion.q_F_B},
                  .v_S_N = robot.motion.v_F,
                  .last_sighting = belief.stamp};
  if (robot.motion_index < 0) return place;
  place.last_sighting = robot.last_sighting;
  place.last_fix = robot.last_fix;
  place.covariance = belief.P.block<FreeMotionAt::kMotion, FreeMotionAt::kMotion>(
      robot.motion_index, robot.motion_index);
  return place;
}

TeamPlace TeamPlace::beyond(RobotId id, const GaussianPose& step, const Eigen::Vector3d& v_step,
                            Timestamp estimated) const {
  const Eigen::Matrix3d R = T_S_N.R();
  MotionMatrix by_here = MotionMatrix::Identity();
  by_here.block<3, 3>(0, 6) = -R * hat(step.pose.p);
  by_here.block<3, 3>(3, 6) = -R * hat(v_step);
  by_here.block<3, 3>(6, 6) = step.pose.R().transpose();
  MotionMatrix by_step = MotionMatrix::Identity();
  by_step.block<3, 3>(0, 0) = R;
  by_step.block<3, 3>(3, 3) = R;
  MotionMatrix alone = MotionMatrix::Zero();
  alone.block<3, 3>(0, 0) = step.covariance.topLeftCorner<3, 3>();
  alone.block<3, 3>(0, 6) = step.covariance.topRightCorner<3, 3>();
  alone.block<3, 3>(6, 0) = step.covariance.bottomLeftCorner<3, 3>();
  alone.block<3, 3>(6, 6) = step.covariance.bottomRightCorner<3, 3>();
  alone.diagonal().segment<3>(3).setConstant(NeighborEstimate::kSpeedSigma *
                                             NeighborEstimate::kSpeedSigma);
  const MotionMatrix here = by_here.lazyProduct(covariance);
  const MotionMatrix there = by_step.lazyProduct(alone);
  TeamPlace place{.T_S_N = T_S_N * step.pose,
                  .v_S_N = v_S_N + R * v_step,
                  .covariance = here.lazyProduct(by_here.transpose()),
                  .last_sighting = std::min(last_sighting, estimated),
                  .last_fix = std::min(last_fix, estimated),
                  .via = id,
                  .by_via = by_here,
                  .of_step = there.lazyProduct(by_step.transpose())};
  place.covariance += place.of_step;
  return place;
}

double TeamPlace::doubt() const {
  return covariance.diagonal().head<3>().sum() + covariance.diagonal().tail<3>().sum();
}

TeamPose TeamPlace::pose(RobotId id, const TeamBelief& belief, const Priors& priors) const {
  constexpr int kOwn = TeamPose::kMotion;
  constexpr int kOther = kOwn + 6;
  TeamPose pose{.neighbor = id,
                .T_B_N = T_S_N,
                .v_B_N = v_S_N,
                .last_sighting = std::max(last_sighting, last_fix)};
  const int own = belief.robots.at(belief.self).bias_index;
  const double gyro = priors.gyro_bias_radps * priors.gyro_bias_radps;
  pose.covariance.topLeftCorner<kOwn, kOwn>() = covariance;
  pose.covariance.block<6, 6>(kOwn, kOwn) = belief.P.block<6, 6>(own, own);
  pose.covariance.diagonal().segment<3>(kOther).setConstant(gyro);
  pose.covariance.diagonal().segment<3>(kOther + 3).setConstant(accel_bias_variance(priors));
  return pose;
}

}  // namespace crepes
