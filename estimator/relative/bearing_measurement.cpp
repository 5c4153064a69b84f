#include "estimator/relative/bearing_measurement.hpp"

#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

constexpr double kMinDistance = 0.10;  // m; below it the rings' extent sets the direction

// d by [p, theta], and where in the error state the seeing camera's misalignment stands.
struct Line {
  Eigen::Vector3d d;
  Eigen::Matrix3d by_p;
  Eigen::Matrix3d by_theta;
  Eigen::Vector3d misalignment;
  int misalignment_index;
};

std::optional<BearingInnovation> linearize(const Line& line, const Eigen::Vector3d& u,
                                           double sigma_rad) {
  const double distance = line.d.norm();
  if (distance < kMinDistance) return std::nullopt;
  const Eigen::Matrix3d M = so3_exp(line.misalignment).toRotationMatrix();
  const Eigen::Vector3d direction = line.d / distance;
  const Eigen::Vector3d predicted = M * direction;
  if (predicted.dot(u) <= 0.0) return std::nullopt;

  const Eigen::Matrix<double, 3, 2> across = tangent_basis(predicted);
  const Eigen::Matrix3d u_by_d =
      M * (Eigen::Matrix3d::Identity() - direction * direction.transpose()) / distance;

  BearingInnovation z;
  z.residual = angles_across(predicted, across, u);
  z.H.setZero();
  z.H.middleCols<3>(ErrorState::kP) = across.transpose() * u_by_d * line.by_p;
  z.H.middleCols<3>(ErrorState::kTheta) = across.transpose() * u_by_d * line.by_theta;
  z.H.middleCols<3>(line.misalignment_index) =
      -across.transpose() * M * hat(direction) * so3_right_jacobian(line.misalignment);
  z.cov_z = sigma_rad * sigma_rad * Eigen::Matrix2d::Identity();
  return z;
}

}  // namespace

std::optional<BearingInnovation> linearize_bearing(const NominalState& state,
                                                   const Eigen::Vector3d& u_B,
                                                   const Eigen::Vector3d& p_B_C,
                                                   const Eigen::Vector3d& p_N_M, double sigma_rad) {
  const Pose& T_B_N = state.motion.T_B_N;
  const Line line{.d = T_B_N * p_N_M - p_B_C,
                  .by_p = Eigen::Matrix3d::Identity(),
                  .by_theta = -T_B_N.R() * hat(p_N_M),
                  .misalignment = state.misalignment_B,
                  .misalignment_index = ErrorState::kMisalignB};
  return linearize(line, u_B, sigma_rad);
}

std::optional<BearingInnovation> linearize_peer_bearing(const NominalState& state,
                                                        const Eigen::Vector3d& u_N,
                                                        const Eigen::Vector3d& p_N_C,
                                                        const Eigen::Vector3d& p_B_M,
                                                        double sigma_rad) {
  const Eigen::Matrix3d R_N_B = state.motion.T_B_N.R().transpose();
  const Eigen::Vector3d p_N_M = R_N_B * (p_B_M - state.motion.T_B_N.p);
  const Line line{.d = p_N_M - p_N_C,
                  .by_p = -R_N_B,
                  .by_theta = hat(p_N_M),
                  .misalignment = state.misalignment_N,
                  .misalignment_index = ErrorState::kMisalignN};
  return linearize(line, u_N, sigma_rad);
}

}  // namespace crepes
