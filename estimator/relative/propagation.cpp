#include "estimator/relative/propagation.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/core/so3.hpp"
#include "estimator/relative/small_product.hpp"

namespace crepes {
namespace {

constexpr Duration kMaxStep = std::chrono::milliseconds{10};

BodyRates rates(const ImuMean& mean, const ImuBias& bias) {
  return {without_errors(mean.gyro_radps, bias.gyro_radps, bias.gyro_scale),
          without_errors(mean.accel_mps2, bias.accel_mps2, bias.accel_scale)};
}

constexpr int kMotion = ErrorState::kMotion;

/// Errors of the rates from the errors of the sensors: the bias, and for each axis the rate times a
/// column of the scale matrix. Each row of `errors` is one case.
template <class Errors>
auto rate_errors(const Errors& errors, const BodyRates& body, const BodyRates& neighbor) {
  using E = ErrorState;
  Eigen::Matrix<double, Errors::RowsAtCompileTime, 12> of_rates;
  const auto collect = [&](int bias, const Eigen::Vector3d& rate, int scale) {
    of_rates.template middleCols<3>(bias - E::kGyroB) =
        errors.template middleCols<3>(bias) + rate(0) * errors.template middleCols<3>(scale) +
        rate(1) * errors.template middleCols<3>(scale + 3) +
        rate(2) * errors.template middleCols<3>(scale + 6);
  };
  collect(E::kGyroB, body.w, E::kGyroScaleB);
  collect(E::kAccelB, body.a, E::kAccelScaleB);
  collect(E::kGyroN, neighbor.w, E::kGyroScaleN);
  collect(E::kAccelN, neighbor.a, E::kAccelScaleN);
  return of_rates;
}

/// Errors of the motion after a step; each row of the arguments is one case.
template <class Motion, class Rates>
auto moved_errors(const Motion& motion, const Rates& rates, const PropagationJacobian& J) {
  using Moved = Eigen::Matrix<double, Motion::RowsAtCompileTime, kMotion>;
  Moved moved = Moved::Zero();
  add_product(motion, J.by_motion, moved);
  subtract_product(rates, J.by_rates, moved);
  return moved;
}

/// Factor of the range bias over a step.
double range_bias_decay(const ProcessNoise& noise, double dt) {
  return std::exp(-noise.range_bias_return * dt);
}

// P <- F P F^T + Q, where F changes the motion and the range bias only.
void propagate_covariance(const PropagationJacobian& J, const BodyRates& body,
                          const BodyRates& neighbor, const Eigen::Matrix<double, 12, 1>& variance,
                          const ProcessNoise& noise, double dt, ErrorState::Covariance& P) {
  using E = ErrorState;
  // P F^T. The rows of the seen states are read from their columns.
  const auto of_seen = moved_errors(P.seen().leftCols<kMotion>(),
                                    rate_errors(P.seen_columns().transpose(), body, neighbor), J);
  const auto of_hidden =
      moved_errors(P.cross().leftCols<kMotion>(), rate_errors(P.hidden_rows(), body, neighbor), J);
  P.columns<0, kMotion>() << of_seen, of_hidden;
  P.seen().block<kMotion, E::kSeen - kMotion>(0, kMotion) =
      of_seen.bottomRows<E::kSeen - kMotion>().transpose();
  // F P F^T + J Q J^T. F contains -J for the rates, so that J Q is subtracted from their errors.
  auto rates = rate_errors(P.columns<0, kMotion>().transpose(), body, neighbor);
  rates -= J.by_rates * variance.asDiagonal();
  const Eigen::Matrix<double, kMotion, kMotion> once =
      P.seen().topLeftCorner<kMotion, kMotion>().transpose();
  const auto twice = moved_errors(once, rates, J);
  P.seen().topLeftCorner<kMotion, kMotion>() = 0.5 * (twice + twice.transpose());

  const double gyro_walk = noise.gyro_walk * noise.gyro_walk * dt;
  const double accel_walk = noise.accel_walk * noise.accel_walk * dt;
  P.diagonal().segment<3>(E::kGyroB).array() += gyro_walk;
  P.diagonal().segment<3>(E::kAccelB).array() += accel_walk;
  P.diagonal().segment<3>(E::kGyroN).array() += gyro_walk;
  P.diagonal().segment<3>(E::kAccelN).array() += accel_walk;
  const double kept = range_bias_decay(noise, dt);
  P.seen_rows<E::kRangeBias, 1>() *= kept;
  P.columns<E::kRangeBias, 1>() *= kept;
  P.diagonal()(E::kRangeBias) += noise.range_bias_walk * noise.range_bias_walk * dt;
}

}  // namespace

RelativeMotion propagated(const RelativeMotion& motion, const BodyRates& body,
                          const BodyRates& neighbor, double dt) {
  const Eigen::Quaterniond half_B = so3_exp(0.5 * dt * body.w);
  const Eigen::Quaterniond half_N = so3_exp(0.5 * dt * neighbor.w);
  const Eigen::Quaterniond dq_B = (half_B * half_B).conjugate();
  const Eigen::Vector3d a = motion.T_B_N.q * (half_N * neighbor.a) - half_B * body.a;
  RelativeMotion next;
  next.T_B_N.p = dq_B * (motion.T_B_N.p + motion.v_B_N * dt + 0.5 * dt * dt * a);
  next.v_B_N = dq_B * (motion.v_B_N + a * dt);
  next.T_B_N.q = (dq_B * motion.T_B_N.q * half_N * half_N).normalized();
  return next;
}

PropagationJacobian propagation_jacobian(const RelativeMotion& before, const RelativeMotion& after,
                                         const BodyRates& body, const BodyRates& neighbor,
                                         double dt) {
  const Eigen::Matrix3d R = before.T_B_N.R();
  const Eigen::Matrix3d half_B = so3_exp(0.5 * dt * body.w).toRotationMatrix();
  const Eigen::Matrix3d half_N = so3_exp(0.5 * dt * neighbor.w).toRotationMatrix();
  const Eigen::Matrix3d dR_B = (half_B * half_B).transpose();
  const Eigen::Matrix3d dR_N = (half_N * half_N).transpose();
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
  // An extrapolated rate is a random walk: after s its error is density * sqrt(s), and the variance
  // of its integral s^3/3 density^2.
  const auto density2 = [&](double specified, double observed, double extrapolation,
                            double innovation, double time2_s2) {
    return square(std::max(specified, observed)) +
           (square(extrapolation) + square(innovation)) * time2_s2;
  };
  Eigen::Matrix<double, 12, 1> variance;
  int row = 0;
  for (const ImuMean* imu : {&body, &neighbor}) {
    variance.segment<3>(row).setConstant(density2(
        noise.gyro_density, imu->gyro_noise_density, ProcessNoise::kGyroExtrapolationDensity,
        imu->gyro_innovation_density, imu->extrapolation_time2_s2));
    variance.segment<3>(row + 3).setConstant(density2(
        noise.accel_density, imu->accel_noise_density, ProcessNoise::kAccelExtrapolationDensity,
        imu->accel_innovation_density, imu->extrapolation_time2_s2));
    variance.segment<3>(row) += imu->turn_variance_rad2 / dt;
    variance.segment<3>(row + 3) += imu->blow_variance_m2ps2 / dt;
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
    state.range_bias_m *= range_bias_decay(noise, dt);
    propagate_covariance(propagation_jacobian(before, state.motion, body, neighbor, dt), body,
                         neighbor, rate_variance(mean_B, mean_N, noise, dt), noise, dt, P);
    P.diagonal().segment<3>(ErrorState::kAccelB).array() += mean_B.bias_variance_m2ps4;
    P.diagonal().segment<3>(ErrorState::kAccelN).array() += mean_N.bias_variance_m2ps4;
    t = next;
  }
}

RelativeMotion propagated_by_imus(const RelativeMotion& motion, const ImuHistory& imu_B,
                                  const ImuHistory& imu_N, Timestamp from, Timestamp to) {
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

Matrix6d error_rotation(const ImuHistory& imu_B, const ImuHistory& imu_N, Timestamp from,
                        Timestamp to) {
  Matrix6d turn = Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = imu_B.rotation(to, from).toRotationMatrix();
  turn.bottomRightCorner<3, 3>() = imu_N.rotation(to, from).toRotationMatrix();
  return turn;
}

}  // namespace crepes
