#include "estimator/team/team_prediction.hpp"

#include <algorithm>

#include "estimator/team/team_interval.hpp"

namespace crepes {
namespace {

BodyRates rates(const ImuMean& mean, const ImuBiasEstimate& bias) {
  const Eigen::Vector3d w = mean.gyro_radps - bias.gyro_radps;
  return {w - bias.gyro_scale * w, mean.accel_mps2 - bias.accel_mps2};
}

}  // namespace

TeamPose predicted(const TeamPose& pose, const TeamImus& imus, Timestamp from, Timestamp to,
                   const ProcessNoise& noise) {
  RelativeMotion motion{pose.T_B_N, pose.v_B_N};
  Eigen::Matrix<double, 9, 9> P = pose.covariance;
  Eigen::Matrix<double, 9, 12> by_bias = Eigen::Matrix<double, 9, 12>::Zero();
  for (Timestamp t = from; t < to;) {
    const Timestamp next = std::min(to, t + TeamInterval::kStep);
    const double dt = to_seconds(next - t);
    const ImuMean mean_B = imus.imu_B.mean(t, next);
    const ImuMean mean_N = imus.imu_N.mean(t + pose.clock_ahead, next + pose.clock_ahead);
    const BodyRates body = rates(mean_B, imus.bias_B);
    const BodyRates neighbor = rates(mean_N, imus.bias_N);
    const RelativeMotion before = motion;
    motion = propagated(before, body, neighbor, dt);
    const PropagationJacobian J = propagation_jacobian(before, motion, body, neighbor, dt);
    const Eigen::Matrix<double, 12, 1> variance = rate_variance(mean_B, mean_N, noise, dt);
    const Eigen::Matrix<double, 9, 9> carried = J.by_motion.lazyProduct(P);
    P = carried.lazyProduct(J.by_motion.transpose());
    const Eigen::Matrix<double, 9, 12> scaled = J.by_rates * variance.asDiagonal();
    P += scaled.lazyProduct(J.by_rates.transpose());
    by_bias = (J.by_motion.lazyProduct(by_bias) + J.by_rates).eval();
    t = next;
  }
  Eigen::Matrix<double, 12, 1> sigma;
  sigma << Eigen::Vector3d::Constant(imus.bias_B.gyro_sigma_radps),
      Eigen::Vector3d::Constant(imus.bias_B.accel_sigma_mps2),
      Eigen::Vector3d::Constant(imus.bias_N.gyro_sigma_radps),
      Eigen::Vector3d::Constant(imus.bias_N.accel_sigma_mps2);
  by_bias = (by_bias * sigma.asDiagonal()).eval();
  P += by_bias.lazyProduct(by_bias.transpose());

  TeamPose at = pose;
  at.T_B_N = motion.T_B_N;
  at.v_B_N = motion.v_B_N;
  at.covariance = 0.5 * (P + P.transpose());
  return at;
}

}  // namespace crepes
