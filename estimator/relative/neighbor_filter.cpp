#include "estimator/relative/neighbor_filter.hpp"

#include "estimator/core/contract.hpp"
#include "estimator/relative/bearing_measurement.hpp"
#include "estimator/relative/pose_measurement.hpp"
#include "estimator/relative/range_measurement.hpp"

namespace crepes {
namespace {

using E = ErrorState;

constexpr double kGraphSpeedSigma = 0.3;  // m/s

ErrorState::Covariance first_covariance(const Matrix6d& pose, double speed_sigma,
                                        const Priors& priors) {
  const auto square = [](double x) { return x * x; };
  E::Covariance P = E::Covariance::Zero();
  P.block<3, 3>(E::kP, E::kP) = pose.topLeftCorner<3, 3>();
  P.block<3, 3>(E::kP, E::kTheta) = pose.topRightCorner<3, 3>();
  P.block<3, 3>(E::kTheta, E::kP) = pose.bottomLeftCorner<3, 3>();
  P.block<3, 3>(E::kTheta, E::kTheta) = pose.bottomRightCorner<3, 3>();
  const auto set = [&](int index, double sigma) {
    P.diagonal().segment<3>(index).setConstant(square(sigma));
  };
  set(E::kV, speed_sigma);
  set(E::kGyroB, priors.gyro_bias_radps);
  set(E::kGyroN, priors.gyro_bias_radps);
  set(E::kAccelB, priors.accel_bias_mps2);
  set(E::kAccelN, priors.accel_bias_mps2);
  set(E::kMisalignB, priors.misalignment_rad);
  set(E::kMisalignN, priors.misalignment_rad);
  P(E::kRangeBias, E::kRangeBias) = square(priors.range_bias_m);
  return P;
}

template <class Linearized, class Correct>
Verdict correct_if(const Linearized& z, const Correct& correct) {
  return z ? correct(*z) : Verdict::kDegenerate;
}

}  // namespace

NeighborFilter::NeighborFilter(Timestamp stamp, const GaussianPose& first,
                               const ProcessNoise& noise, const Priors& priors)
    : stamp_(stamp),
      P_(first_covariance(first.covariance, priors.speed_mps, priors)),
      noise_(noise) {
  state_.motion.T_B_N = first.pose;
}

NeighborFilter::NeighborFilter(Timestamp stamp, const GraphPose& first, const ProcessNoise& noise,
                               const Priors& priors)
    : stamp_(stamp),
      P_(first_covariance(first.T_B_N.covariance, kGraphSpeedSigma, priors)),
      noise_(noise) {
  state_.motion = {first.T_B_N.pose, first.v_B_N};
}

void NeighborFilter::advance_to(Timestamp to, const ImuHistory& imu_B, const ImuHistory& imu_N) {
  CREPES_EXPECT(to >= stamp_, "a filter moves forward only");
  propagate(imu_B, imu_N, stamp_, to, noise_, state_, P_);
  stamp_ = to;
}

template <int M>
Verdict NeighborFilter::correct(const Innovation<M, ErrorState::kSize>& z, double gate_nis) {
  const auto outcome = kalman_update(z, gate_nis, P_);
  if (outcome.verdict == Verdict::kFused) inject(outcome.correction, state_);
  return outcome.verdict;
}

Verdict NeighborFilter::fuse_bearing(const DirectionReading& z, const Eigen::Vector3d& p_N_M,
                                     double gate_nis) {
  return correct_if(linearize_bearing(state_, z.u, z.camera, p_N_M, z.sigma_rad),
                    [&](const auto& innovation) { return correct(innovation, gate_nis); });
}

Verdict NeighborFilter::fuse_peer_bearing(const DirectionReading& z, const Eigen::Vector3d& p_B_M,
                                          double gate_nis) {
  return correct_if(linearize_peer_bearing(state_, z.u, z.camera, p_B_M, z.sigma_rad),
                    [&](const auto& innovation) { return correct(innovation, gate_nis); });
}

Verdict NeighborFilter::fuse_range(const RangeReading& z, const Eigen::Vector3d& p_B_U,
                                   const Eigen::Vector3d& p_N_Q, double gate_nis) {
  return correct_if(linearize_range(state_, p_B_U, p_N_Q, z.range_m, z.sigma_m),
                    [&](const auto& innovation) { return correct(innovation, gate_nis); });
}

Verdict NeighborFilter::fuse_pose(const GaussianPose& T_B_N, double gate_nis) {
  return correct(linearize_pose(state_, T_B_N), gate_nis);
}

Matrix6d NeighborFilter::pose_covariance() const {
  Matrix6d covariance;
  covariance << P_.block<3, 3>(E::kP, E::kP), P_.block<3, 3>(E::kP, E::kTheta),
      P_.block<3, 3>(E::kTheta, E::kP), P_.block<3, 3>(E::kTheta, E::kTheta);
  return covariance;
}

}  // namespace crepes
