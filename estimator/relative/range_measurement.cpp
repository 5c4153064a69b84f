#include "estimator/relative/range_measurement.hpp"

#include "estimator/core/so3.hpp"

namespace crepes {

std::optional<RangeInnovation> linearize_range(const NominalState& state,
                                               const Eigen::Vector3d& p_B_U,
                                               const Eigen::Vector3d& p_N_Q, double range_m,
                                               double sigma_m) {
  constexpr double kMinBaseline = 0.05;  // m; below it the lever-arm error sets the direction
  const Pose& T_B_N = state.motion.T_B_N;
  const Eigen::Vector3d p_U_Q_B = T_B_N * p_N_Q - p_B_U;
  const double distance = p_U_Q_B.norm();
  if (distance < kMinBaseline) return std::nullopt;

  const Eigen::RowVector3d direction = p_U_Q_B.transpose() / distance;
  RangeInnovation z;
  z.residual(0) = range_m - distance - state.range_bias_m;
  z.H.setZero();
  z.H.middleCols<3>(ErrorState::kP) = direction;
  z.H.middleCols<3>(ErrorState::kTheta) = -direction * T_B_N.R() * hat(p_N_Q);
  z.H(0, ErrorState::kRangeBias) = 1.0;
  z.cov_z(0, 0) = sigma_m * sigma_m;
  return z;
}

}  // namespace crepes
