#include "estimator/team/team_prediction.hpp"

#include <algorithm>

#include "estimator/team/belief/team_interval.hpp"

namespace crepes {
namespace {

BodyRates rates(const ImuMean& mean, const ImuBiasEstimate& bias) {
  return {without_errors(mean.gyro_radps, bias.gyro_radps, bias.gyro_scale),
          mean.accel_mps2 - bias.accel_mps2};
}

}  // namespace

TeamPose predicted(const TeamPose& pose, const TeamImus& imus, Timestamp from, Timestamp to,
                   const ProcessNoise& noise) {
  RelativeMotion motion{pose.T_B_N, pose.v_B_N};
  constexpr int kMotion = TeamPose::kMotion;
  constexpr int kBiases = TeamPose::kBiases;
  // Of the motion at `t`, by the motion at `from` and by the biases; what the noise adds.
  Eigen::Matrix<double, kMotion, kMotion + kBiases> by_start;
  by_start << Eigen::Matrix<double, kMotion, kMotion>::Identity(),
      Eigen::Matrix<double, kMotion, kBiases>::Zero();
  Eigen::Matrix<double, kMotion, kMotion> noise_added =
      Eigen::Matrix<double, kMotion, kMotion>::Zero();
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
    const Eigen::Matrix<double, kMotion, kMotion> carried = J.by_motion.lazyProduct(noise_added);
    noise_added = carried.lazyProduct(J.by_motion.transpose());
    const Eigen::Matrix<double, kMotion, kBiases> scaled = J.by_rates * variance.asDiagonal();
    noise_added += scaled.lazyProduct(J.by_rates.transpose());
    by_start = J.by_motion.lazyProduct(by_start).eval();
    by_start.rightCols<kBiases>() -= J.by_rates;  // a rate is what was measured minus the bias
    t = next;
  }
  const Eigen::Matrix<double, kMotion, kMotion + kBiases> of_start = by_start * pose.covariance;
  Eigen::Matrix<double, kMotion, kMotion> P = of_start.lazyProduct(by_start.transpose());
  P += noise_added;

  TeamPose at = pose;
  at.T_B_N = motion.T_B_N;
  at.v_B_N = motion.v_B_N;
  at.covariance.topLeftCorner<kMotion, kMotion>() = 0.5 * (P + P.transpose());
  const Eigen::Matrix<double, kMotion, kBiases> with_biases = of_start.rightCols<kBiases>();
  at.covariance.topRightCorner<kMotion, kBiases>() = with_biases;
  at.covariance.bottomLeftCorner<kBiases, kMotion>() = with_biases.transpose();
  return at;
}

}  // namespace crepes
