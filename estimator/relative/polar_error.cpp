#include "estimator/relative/polar_error.hpp"

#include <algorithm>

#include "estimator/core/so3.hpp"

namespace crepes {

using E = ErrorState;

RelativeMotion corrected(const RelativeMotion& motion, const MotionError& dx) {
  constexpr double kLeast = 0.1;  // of the distance
  const auto& [T_B_N, v_B_N] = motion;
  const Eigen::Vector3d dp = dx.segment<3>(E::kP);
  const Eigen::Vector3d dv = dx.segment<3>(E::kV);
  const Eigen::Vector3d theta = dx.segment<3>(E::kTheta);
  const double rho = T_B_N.p.norm();
  if (!(rho > 0.0)) return {perturbed(T_B_N, (Vector6d() << dp, theta).finished()), v_B_N + dv};

  const Eigen::Vector3d u = T_B_N.p / rho;
  const double ds = u.dot(dp) / rho;
  const Eigen::Vector3d phi = u.cross(dp) / rho;
  const double stretch = std::max(1.0 + ds, kLeast);
  const Eigen::Quaterniond turn = so3_exp(phi);
  return {{stretch * (turn * T_B_N.p),
           (turn * T_B_N.q * so3_exp(theta - T_B_N.q.conjugate() * phi)).normalized()},
          stretch * (turn * (v_B_N + dv - ds * v_B_N - phi.cross(v_B_N)))};
}

MotionTransport error_transport(const RelativeMotion& before, const RelativeMotion& after) {
  MotionTransport T = MotionTransport::Identity();
  const double rho = before.T_B_N.p.norm();
  const double stretch = after.T_B_N.p.norm() / rho;
  if (!(rho > 0.0 && stretch > 0.0)) return T;

  const Eigen::Vector3d u = before.T_B_N.p / rho;
  const Eigen::Matrix3d R_N_B = before.T_B_N.R().transpose();
  const Eigen::Matrix3d R_N_B_after = after.T_B_N.R().transpose();
  const Eigen::Matrix3d turn = shortest_rotation(u, after.T_B_N.p).toRotationMatrix();
  const Eigen::Matrix3d turn_N =
      shortest_rotation(R_N_B * u, R_N_B_after * after.T_B_N.p).toRotationMatrix();
  // Of a rotation phi = u x dp / rho of the line of sight, and of dln rho = u . dp / rho, besides
  // the rotation and stretching of everything.
  const Eigen::Matrix3d phi_by_p = hat(u) / rho;
  const Eigen::Vector3d rest = after.v_B_N - stretch * (turn * before.v_B_N);
  T.block<3, 3>(E::kP, E::kP) = stretch * turn;
  T.block<3, 3>(E::kV, E::kP) = rest * u.transpose() / rho - hat(rest) * turn * phi_by_p;
  T.block<3, 3>(E::kV, E::kV) = stretch * turn;
  T.block<3, 3>(E::kTheta, E::kP) = (R_N_B_after * turn - turn_N * R_N_B) * phi_by_p;
  T.block<3, 3>(E::kTheta, E::kTheta) = turn_N;
  return T;
}

MotionTransport error_transport_of_blind(const RelativeMotion& before,
                                         const RelativeMotion& after) {
  MotionTransport T = error_transport(before, after);
  T.middleRows<3>(E::kTheta) = MotionTransport::Identity().middleRows<3>(E::kTheta);
  return T;
}

}  // namespace crepes
