#include "estimator/relative/paper_filter.hpp"

#include <algorithm>

#include "estimator/core/contract.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

using E = PaperError;

constexpr Duration kMaxStep = std::chrono::milliseconds{10};
constexpr double kFirstSpeedSigma = 2.0;  // m/s

// J of [dp, dtheta] = J dx:  dp = dp + [p]x theta_B,  dtheta = theta_A - R^T theta_B.
Eigen::Matrix<double, 6, E::kSize> pose_by_error(const RelativeMotion& x) {
  Eigen::Matrix<double, 6, E::kSize> J;
  J.setZero();
  J.block<3, 3>(0, E::kP).setIdentity();
  J.block<3, 3>(0, E::kThetaB) = hat(x.T_B_N.p);
  J.block<3, 3>(3, E::kThetaA).setIdentity();
  J.block<3, 3>(3, E::kThetaB) = -x.T_B_N.R().transpose();
  return J;
}

// The pose's covariance put into dp and theta_A: theta_B then starts at zero by choice of frame.
PaperError::Covariance first_covariance(const Matrix6d& pose) {
  PaperError::Covariance P = PaperError::Covariance::Zero();
  P.block<3, 3>(E::kP, E::kP) = pose.topLeftCorner<3, 3>();
  P.block<3, 3>(E::kP, E::kThetaA) = pose.topRightCorner<3, 3>();
  P.block<3, 3>(E::kThetaA, E::kP) = pose.bottomLeftCorner<3, 3>();
  P.block<3, 3>(E::kThetaA, E::kThetaA) = pose.bottomRightCorner<3, 3>();
  P.diagonal().segment<3>(E::kV).setConstant(kFirstSpeedSigma * kFirstSpeedSigma);
  return P;
}

}  // namespace

RelativeMotion paper_plus(const RelativeMotion& x, const PaperError::Vector& dx) {
  const Eigen::Quaterniond dq_B_inv = so3_exp(dx.segment<3>(E::kThetaB)).conjugate();
  RelativeMotion x_t;
  x_t.T_B_N.p = dq_B_inv * (x.T_B_N.p + dx.segment<3>(E::kP));
  x_t.v_B_N = dq_B_inv * (x.v_B_N + dx.segment<3>(E::kV));
  x_t.T_B_N.q = (dq_B_inv * x.T_B_N.q * so3_exp(dx.segment<3>(E::kThetaA))).normalized();
  return x_t;
}

RelativeMotion paper_propagated(const RelativeMotion& x, const BodyRates& a_B, const BodyRates& a_A,
                                double dt) {
  const Eigen::Quaterniond dq_B_inv = so3_exp(a_B.w * dt).conjugate();
  const Eigen::Vector3d a = x.T_B_N.q * a_A.a - a_B.a;
  RelativeMotion next;
  next.T_B_N.p = dq_B_inv * (x.T_B_N.p + x.v_B_N * dt + 0.5 * dt * dt * a);
  next.v_B_N = dq_B_inv * (x.v_B_N + a * dt);
  next.T_B_N.q = (dq_B_inv * x.T_B_N.q * so3_exp(a_A.w * dt)).normalized();
  return next;
}

PaperError::Covariance paper_transition(const RelativeMotion& x, const BodyRates& rates_B,
                                        const BodyRates& rates_A, double dt) {
  const Eigen::Matrix3d dR_B = so3_exp(rates_B.w * dt).conjugate().toRotationMatrix();
  const Eigen::Matrix3d dR_A = so3_exp(rates_A.w * dt).conjugate().toRotationMatrix();
  PaperError::Covariance F = PaperError::Covariance::Zero();
  F.block<3, 3>(E::kP, E::kP) = dR_B;
  F.block<3, 3>(E::kP, E::kV) = dR_B * dt;
  F.block<3, 3>(E::kV, E::kV) = dR_B;
  F.block<3, 3>(E::kV, E::kThetaA) = -dt * dR_B * x.T_B_N.R() * hat(rates_A.a);
  F.block<3, 3>(E::kV, E::kThetaB) = dt * dR_B * hat(rates_B.a);
  F.block<3, 3>(E::kThetaA, E::kThetaA) = dR_A;
  F.block<3, 3>(E::kThetaB, E::kThetaB) = dR_B;
  return F;
}

PaperError::Covariance paper_noise_input(const RelativeMotion& x, const BodyRates& rates_B,
                                         double dt) {
  const Eigen::Matrix3d dR_B = so3_exp(rates_B.w * dt).conjugate().toRotationMatrix();
  PaperError::Covariance F = PaperError::Covariance::Zero();
  F.block<3, 3>(E::kV, 0) = -dt * dR_B * x.T_B_N.R();
  F.block<3, 3>(E::kThetaA, 3) = -dt * Eigen::Matrix3d::Identity();
  F.block<3, 3>(E::kV, 6) = dt * dR_B;
  F.block<3, 3>(E::kThetaB, 9) = -dt * Eigen::Matrix3d::Identity();
  return F;
}

Innovation<9, PaperError::kSize> paper_innovation(const RelativeMotion& x, const RawPose& z) {
  const Eigen::Matrix3d R_A_B = x.T_B_N.R().transpose();
  const Eigen::Vector3d p_A_B = -(R_A_B * x.T_B_N.p);
  Innovation<9, E::kSize> innovation;
  innovation.residual << z.T_B_N.p - x.T_B_N.p, z.p_N_B - p_A_B,
      so3_log(x.T_B_N.q.conjugate() * z.T_B_N.q);

  // h(x (+) dx) to first order:  p + dp + [p]x theta_B;
  // -R^T p - R^T dp + [-R^T p]x theta_A (theta_B cancels);  theta_A - R^T theta_B.
  const Eigen::Matrix<double, 6, E::kSize> by_pose = pose_by_error(x);
  innovation.H.setZero();
  innovation.H.topRows<3>() = by_pose.topRows<3>();
  innovation.H.block<3, 3>(3, E::kP) = -R_A_B;
  innovation.H.block<3, 3>(3, E::kThetaA) = hat(p_A_B);
  innovation.H.bottomRows<3>() = by_pose.bottomRows<3>();
  innovation.cov_z = z.covariance;
  return innovation;
}

PaperError::Covariance paper_reset(const PaperError::Vector& dx_hat) {
  // With Exp(theta) = Exp(theta_hat) Exp(theta_new):  theta_new = -theta_hat + (I - [theta_hat/2]x)
  // theta, so the paper's sign is right, and so is R^T{theta_B} before dp and dv.
  const Eigen::Vector3d theta_A = dx_hat.segment<3>(E::kThetaA);
  const Eigen::Vector3d theta_B = dx_hat.segment<3>(E::kThetaB);
  const Eigen::Matrix3d R_B = so3_exp(theta_B).conjugate().toRotationMatrix();
  PaperError::Covariance G = PaperError::Covariance::Identity();
  G.block<3, 3>(E::kP, E::kP) = R_B;
  G.block<3, 3>(E::kV, E::kV) = R_B;
  G.block<3, 3>(E::kThetaA, E::kThetaA) -= hat(0.5 * theta_A);
  G.block<3, 3>(E::kThetaB, E::kThetaB) -= hat(0.5 * theta_B);
  return G;
}

PaperFilter::PaperFilter(Timestamp stamp, const RawPose& first, const ProcessNoise& noise)
    : stamp_(stamp),
      x_{first.T_B_N, Eigen::Vector3d::Zero()},
      P_(first_covariance(first.gaussian().covariance)),
      noise_(noise) {}

PaperFilter::PaperFilter(Timestamp stamp, const GraphPose& first, const ProcessNoise& noise)
    : stamp_(stamp),
      x_{first.T_B_N.pose, first.v_B_N},
      P_(first_covariance(first.T_B_N.covariance)),
      noise_(noise) {}

void PaperFilter::advance_to(Timestamp to, const ImuHistory& imu_B, const ImuHistory& imu_N) {
  CREPES_EXPECT(to >= stamp_, "a filter moves forward only");
  while (stamp_ < to) {
    const Timestamp next = std::min(to, stamp_ + kMaxStep);
    const double dt = to_seconds(next - stamp_);
    const ImuMean mean_B = imu_B.mean(stamp_, next);
    const ImuMean mean_N = imu_N.mean(stamp_, next);
    const BodyRates rates_B{mean_B.gyro_radps, mean_B.accel_mps2};
    const BodyRates rates_A{mean_N.gyro_radps, mean_N.accel_mps2};

    // rate_variance orders w_B, a_B, w_N, a_N; the paper's u_n is a_nA, w_nA, a_nB, w_nB.
    const Eigen::Matrix<double, 12, 1> variance = rate_variance(mean_B, mean_N, noise_, dt);
    PaperError::Vector Q;
    Q << variance.segment<3>(9), variance.segment<3>(6), variance.segment<3>(3),
        variance.segment<3>(0);
    const PaperError::Covariance F_x = paper_transition(x_, rates_B, rates_A, dt);
    const PaperError::Covariance F_i = paper_noise_input(x_, rates_B, dt);
    P_ = (F_x * P_ * F_x.transpose() + F_i * Q.asDiagonal() * F_i.transpose()).eval();
    x_ = paper_propagated(x_, rates_B, rates_A, dt);
    stamp_ = next;
  }
}

template <int M>
Fusion PaperFilter::correct(const Innovation<M, PaperError::kSize>& z, double gate_nis) {
  const auto outcome = kalman_update(z, gate_nis, P_);
  const Fusion fusion = fusion_of(z, outcome);
  if (outcome.verdict != Verdict::kFused) return fusion;
  x_ = paper_plus(x_, outcome.correction);
  const PaperError::Covariance G = paper_reset(outcome.correction);
  P_ = (G * P_ * G.transpose()).eval();
  return fusion;
}

Fusion PaperFilter::fuse(const RawPose& z, double gate_nis) {
  return correct(paper_innovation(x_, z), gate_nis);
}

Fusion PaperFilter::fuse(const GaussianPose& T_B_N, double gate_nis) {
  Innovation<6, E::kSize> z;
  z.residual = pose_difference(x_.T_B_N, T_B_N.pose);
  z.H = pose_by_error(x_);
  z.cov_z = T_B_N.covariance;
  return correct(z, gate_nis);
}

Matrix6d PaperFilter::pose_covariance() const {
  const Eigen::Matrix<double, 6, E::kSize> J = pose_by_error(x_);
  const Matrix6d covariance = J * P_ * J.transpose();
  return 0.5 * (covariance + covariance.transpose());
}

}  // namespace crepes
