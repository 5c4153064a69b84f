#include "estimator/relative/propagation.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

constexpr Duration kMaxStep = std::chrono::milliseconds{10};

BodyRates rates(const ImuMean& mean, const ImuBias& bias) {
  const Eigen::Vector3d w = mean.gyro_radps - bias.gyro_radps;
  const Eigen::Vector3d a = mean.accel_mps2 - bias.accel_mps2;
  return {w - bias.gyro_scale * w, a - bias.accel_scale * a};
}

constexpr int kMotion = ErrorState::kGyroB;  // size of [p, v, theta]

/// E F^T of the motion after a step, where E's rows are errors: what J makes of the motion's and
/// the rates', and the rates' are those of the biases and, by each axis a robot turns or is pushed
/// about, of a column of its sensors' scales.
template <int kRows>
Eigen::Matrix<double, kRows, kMotion> moved_errors(
    const Eigen::Matrix<double, kRows, ErrorState::kSize>& errors, const PropagationJacobian& J,
    const BodyRates& body, const BodyRates& neighbor) {
  using E = ErrorState;
  Eigen::Matrix<double, kRows, 12> of_rates;
  const auto collect = [&](int bias, const Eigen::Vector3d& rate, int scale) {
    of_rates.template middleCols<3>(bias - kMotion) =
        errors.template middleCols<3>(bias) + rate(0) * errors.template middleCols<3>(scale) +
        rate(1) * errors.template middleCols<3>(scale + 3) +
        rate(2) * errors.template middleCols<3>(scale + 6);
  };
  collect(E::kGyroB, body.w, E::kGyroScaleB);
  collect(E::kAccelB, body.a, E::kAccelScaleB);
  collect(E::kGyroN, neighbor.w, E::kGyroScaleN);
  collect(E::kAccelN, neighbor.a, E::kAccelScaleN);

  // By stripes of rows that registers hold; `by_motion` is triangular by blocks.
  constexpr int kStripe = kRows % 16 == 0 ? 16 : kRows;
  Eigen::Matrix<double, kRows, kMotion> moved;
  for (int row = 0; row < kRows; row += kStripe) {
    for (int i = 0; i < kMotion; ++i) {
      Eigen::Matrix<double, kStripe, 1> sum = Eigen::Matrix<double, kStripe, 1>::Zero();
      for (int k = i / 3 * 3; k < kMotion; ++k)
        sum += J.by_motion(i, k) * errors.col(k).template segment<kStripe>(row);
      for (int k = 0; k < 12; ++k)
        sum -= J.by_rates(i, k) * of_rates.col(k).template segment<kStripe>(row);
      moved.col(i).template segment<kStripe>(row) = sum;
    }
  }
  return moved;
}

/// Share of the range's bias that is left after a step.
double range_bias_kept(const ProcessNoise& noise, double dt) {
  return std::exp(-noise.range_bias_return * dt);
}

// P <- F P F^T + Q, where F leaves all but the motion and the range's bias as it is.
void propagate_covariance(const PropagationJacobian& J, const BodyRates& body,
                          const BodyRates& neighbor, const Eigen::Matrix<double, 12, 1>& variance,
                          const ProcessNoise& noise, double dt, ErrorState::Covariance& P) {
  using E = ErrorState;
  constexpr int kRest = E::kSize - kMotion;  // biases and calibration

  const Eigen::Matrix<double, E::kSize, kMotion> columns = moved_errors(P, J, body, neighbor);
  // F P, from whose biases J Q is taken: as F has -J there, the next product adds J Q J^T. The row
  // of zeros makes their number even, which is faster.
  Eigen::Matrix<double, kMotion + 1, E::kSize> rows;
  rows << columns.transpose(), Eigen::Matrix<double, 1, E::kSize>::Zero();
  rows.topRows<kMotion>().middleCols<12>(kMotion) -= J.by_rates * variance.asDiagonal();
  const Eigen::Matrix<double, kMotion, kMotion> motion =
      moved_errors(rows, J, body, neighbor).topRows<kMotion>();
  P.topLeftCorner<kMotion, kMotion>() = 0.5 * (motion + motion.transpose());
  P.topRightCorner<kMotion, kRest>() = columns.bottomRows<kRest>().transpose();
  P.bottomLeftCorner<kRest, kMotion>() = columns.bottomRows<kRest>();

  const double gyro_walk = noise.gyro_walk * noise.gyro_walk * dt;
  const double accel_walk = noise.accel_walk * noise.accel_walk * dt;
  P.diagonal().segment<3>(E::kGyroB).array() += gyro_walk;
  P.diagonal().segment<3>(E::kAccelB).array() += accel_walk;
  P.diagonal().segment<3>(E::kGyroN).array() += gyro_walk;
  P.diagonal().segment<3>(E::kAccelN).array() += accel_walk;
  const double kept = range_bias_kept(noise, dt);
  P.row(E::kRangeBias) *= kept;
  P.col(E::kRangeBias) *= kept;
  P(E::kRangeBias, E::kRangeBias) += noise.range_bias_walk * noise.range_bias_walk * dt;
}

}  // namespace

RelativeMotion propagated(const RelativeMotion& motion, const BodyRates& body,
                          const BodyRates& neighbor, double dt) {
  const Eigen::Quaterniond dq_B = so3_exp(body.w * dt).conjugate();
  const Eigen::Vector3d a = motion.T_B_N.q * (so3_exp(0.5 * dt * neighbor.w) * neighbor.a) -
                            so3_exp(0.5 * dt * body.w) * body.a;
  RelativeMotion next;
  next.T_B_N.p = dq_B * (motion.T_B_N.p + motion.v_B_N * dt + 0.5 * dt * dt * a);
  next.v_B_N = dq_B * (motion.v_B_N + a * dt);
  next.T_B_N.q = (dq_B * motion.T_B_N.q * so3_exp(neighbor.w * dt)).normalized();
  return next;
}

PropagationJacobian propagation_jacobian(const RelativeMotion& before, const RelativeMotion& after,
                                         const BodyRates& body, const BodyRates& neighbor,
                                         double dt) {
  const Eigen::Matrix3d R = before.T_B_N.R();
  const Eigen::Matrix3d dR_B = so3_exp(body.w * dt).conjugate().toRotationMatrix();
  const Eigen::Matrix3d dR_N = so3_exp(neighbor.w * dt).conjugate().toRotationMatrix();
  const Eigen::Matrix3d half_B = so3_exp(0.5 * dt * body.w).toRotationMatrix();
  const Eigen::Matrix3d half_N = so3_exp(0.5 * dt * neighbor.w).toRotationMatrix();
  const Eigen::Matrix3d J_B = dt * so3_right_jacobian(body.w * dt);
  const Eigen::Matrix3d J_N = dt * so3_right_jacobian(neighbor.w * dt);

  // da, in B's axes before the step, by theta and by the rates; the last two through Exp(w dt/2).
  const Eigen::Matrix3d a_by_theta = -R * hat(half_N * neighbor.a);
  const Eigen::Matrix3d a_by_w_B =
      0.5 * dt * half_B * hat(body.a) * so3_right_jacobian(0.5 * dt * body.w);
  const Eigen::Matrix3d a_by_w_N =
      -0.5 * dt * R * half_N * hat(neighbor.a) * so3_right_jacobian(0.5 * dt * neighbor.w);
  const Eigen::Matrix3d a_by_a_N = R * half_N;

  const double half_dt2 = 0.5 * dt * dt;
  PropagationJacobian J;
  J.by_motion.setZero();
  J.by_motion.block<3, 3>(0, 0) = dR_B;
  J.by_motion.block<3, 3>(0, 3) = dR_B * dt;
  J.by_motion.block<3, 3>(0, 6) = half_dt2 * dR_B * a_by_theta;
  J.by_motion.block<3, 3>(3, 3) = dR_B;
  J.by_motion.block<3, 3>(3, 6) = dt * dR_B * a_by_theta;
  J.by_motion.block<3, 3>(6, 6) = dR_N;

  J.by_rates.setZero();
  J.by_rates.block<3, 3>(0, 0) = hat(after.T_B_N.p) * J_B + half_dt2 * dR_B * a_by_w_B;
  J.by_rates.block<3, 3>(0, 3) = -half_dt2 * dR_B * half_B;
  J.by_rates.block<3, 3>(0, 6) = half_dt2 * dR_B * a_by_w_N;
  J.by_rates.block<3, 3>(0, 9) = half_dt2 * dR_B * a_by_a_N;
  J.by_rates.block<3, 3>(3, 0) = hat(after.v_B_N) * J_B + dt * dR_B * a_by_w_B;
  J.by_rates.block<3, 3>(3, 3) = -dt * dR_B * half_B;
  J.by_rates.block<3, 3>(3, 6) = dt * dR_B * a_by_w_N;
  J.by_rates.block<3, 3>(3, 9) = dt * dR_B * a_by_a_N;
  J.by_rates.block<3, 3>(6, 0) = -after.T_B_N.R().transpose() * J_B;
  J.by_rates.block<3, 3>(6, 6) = J_N;
  return J;
}

Eigen::Matrix<double, 12, 1> rate_variance(const ImuMean& body, const ImuMean& neighbor,
                                           const ProcessNoise& noise, double dt) {
  const auto square = [](double x) { return x * x; };
  // A rate held for s is off by surprise * sqrt(s), and stays so: its integral by s^3/3 surprise^2.
  const auto density2 = [&](double white, double shown, double guess, double surprise,
                            double held_s2) {
    return square(std::max(white, shown)) + (square(guess) + square(surprise)) * held_s2;
  };
  Eigen::Matrix<double, 12, 1> variance;
  int row = 0;
  for (const ImuMean* imu : {&body, &neighbor}) {
    variance.segment<3>(row).setConstant(density2(noise.gyro_density, imu->gyro_density,
                                                  noise.gyro_guess_change, imu->gyro_surprise,
                                                  imu->held_s2));
    variance.segment<3>(row + 3).setConstant(density2(noise.accel_density, imu->accel_density,
                                                      noise.accel_guess_change, imu->accel_surprise,
                                                      imu->held_s2));
    row += 6;
  }
  return variance / dt;
}

void propagate(const ImuHistory& imu_B, const ImuHistory& imu_N, Timestamp from, Timestamp to,
               const ProcessNoise& noise, NominalState& state, ErrorState::Covariance& P) {
  for (Timestamp t = from; t < to;) {
    const Timestamp next = std::min(to, t + kMaxStep);
    const double dt = to_seconds(next - t);
    const ImuMean mean_B = imu_B.mean(t, next);
    const ImuMean mean_N = imu_N.mean(t, next);
    const BodyRates body = rates(mean_B, state.bias_B);
    const BodyRates neighbor = rates(mean_N, state.bias_N);
    const RelativeMotion before = state.motion;
    state.motion = propagated(before, body, neighbor, dt);
    state.range_bias_m *= range_bias_kept(noise, dt);
    propagate_covariance(propagation_jacobian(before, state.motion, body, neighbor, dt), body,
                         neighbor, rate_variance(mean_B, mean_N, noise, dt), noise, dt, P);
    t = next;
  }
}

RelativeMotion moved(const RelativeMotion& motion, const ImuHistory& imu_B, const ImuHistory& imu_N,
                     Timestamp from, Timestamp to) {
  RelativeMotion state = motion;
  const bool back = to < from;
  for (Timestamp t = from; t != to;) {
    const Timestamp next = back ? std::max(to, t - kMaxStep) : std::min(to, t + kMaxStep);
    const ImuMean mean_B = imu_B.mean(std::min(t, next), std::max(t, next));
    const ImuMean mean_N = imu_N.mean(std::min(t, next), std::max(t, next));
    state = propagated(state, rates(mean_B, {}), rates(mean_N, {}), to_seconds(next - t));
    t = next;
  }
  return state;
}

}  // namespace crepes
