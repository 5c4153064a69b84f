#include "estimator/relative/range_measurement.hpp"

#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

/// Between `p_B` on our body and `p_N` on the neighbor's.
std::optional<RangeInnovation> linearize_distance(const NominalState& state,
                                                  const Eigen::Vector3d& p_B,
                                                  const Eigen::Vector3d& p_N, double distance_m,
                                                  double sigma_m) {
  constexpr double kMinBaseline = 0.05;  // m; below it the lever-arm error sets the direction
  const Pose& T_B_N = state.motion.T_B_N;
  const Eigen::Vector3d line = T_B_N * p_N - p_B;
  const double distance = line.norm();
  if (distance < kMinBaseline) return std::nullopt;

  const Eigen::RowVector3d direction = line.transpose() / distance;
  RangeInnovation z;
  z.residual(0) = distance_m - distance;
  z.H.setZero();
  z.H.middleCols<3>(ErrorState::kP) = direction;
  z.H.middleCols<3>(ErrorState::kTheta) = -direction * T_B_N.R() * hat(p_N);
  z.cov_z(0, 0) = sigma_m * sigma_m;
  return z;
}

}  // namespace

std::optional<RangeInnovation> linearize_range(const NominalState& state,
                                               const Eigen::Vector3d& p_B_U,
                                               const Eigen::Vector3d& p_N_Q, double range_m,
                                               double sigma_m) {
  auto z = linearize_distance(state, p_B_U, p_N_Q, range_m, sigma_m);
  if (!z) return z;
  z->residual(0) -= state.range_bias_m;
  z->H(0, ErrorState::kRangeBias) = 1.0;
  return z;
}

std::optional<RangeInnovation> linearize_ring_distance(const NominalState& state,
                                                       const Eigen::Vector3d& p_B_C,
                                                       const Eigen::Vector3d& p_N_M,
                                                       double distance_m, double sigma_m) {
  return linearize_distance(state, p_B_C, p_N_M, distance_m, sigma_m);
}

}  // namespace crepes
