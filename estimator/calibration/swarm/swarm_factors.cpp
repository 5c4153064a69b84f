#include "estimator/calibration/swarm/swarm_factors.hpp"

#include <ceres/jet.h>

#include "estimator/calibration/batch/jet_geometry.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

constexpr double kLeastDistance = 0.05;  // m, between antennas

template <class T>
std::optional<Eigen::Matrix<T, 2, 1>> spot_of(const RobotConstants& observer,
                                              const BodyAt& observer_at,
                                              const RobotConstants& other, const BodyAt& other_at) {
  namespace at = sighting_columns;
  const Matrix3<T> R_W_B = seeded_rotation<T>(observer_at.q_W_B, at::kObserver);
  const Vector3<T> p_W_B = seeded<T>(observer_at.p_W, at::kObserver + 3);
  const Matrix3<T> R_W_N = seeded_rotation<T>(other_at.q_W_B, at::kOther);
  const Vector3<T> p_W_N = seeded<T>(other_at.p_W, at::kOther + 3);
  Eigen::Matrix<T, 6, 1> lens;
  for (int i = 0; i < 6; ++i) lens[i] = seeded<T>(observer.camera.lens[i], at::kCamera + i);
  const Matrix3<T> R_C_B = seeded_rotation<T>(observer.camera.q_C_B, at::kCamera + 6);
  const Vector3<T> p_B_C = seeded<T>(observer.camera.p_B_C, at::kCamera + 9);
  const Vector3<T> ring_W = p_W_N + R_W_N * seeded<T>(other.p_B_M, at::kRing);
  const Vector3<T> ring_B = R_W_B.transpose() * (ring_W - p_W_B);
  return project_double_sphere<T>(lens, R_C_B * (ring_B - p_B_C));
}

}  // namespace

std::optional<Eigen::Vector2d> predicted_spot(const RobotConstants& observer,
                                              const BodyAt& observer_at,
                                              const RobotConstants& other, const BodyAt& other_at) {
  return spot_of<double>(observer, observer_at, other, other_at);
}

std::optional<SightingFactor> linearize_sighting(const RobotConstants& observer,
                                                 const BodyAt& observer_at,
                                                 const RobotConstants& other,
                                                 const BodyAt& other_at) {
  using Jet = ceres::Jet<double, sighting_columns::kSize>;
  const auto uv = spot_of<Jet>(observer, observer_at, other, other_at);
  if (!uv) return std::nullopt;
  SightingFactor factor;
  factor.uv = {uv->x().a, uv->y().a};
  factor.J << uv->x().v.transpose(), uv->y().v.transpose();
  return factor;
}

std::optional<RangeFactor> linearize_antenna_range(const RobotConstants& observer,
                                                   const BodyAt& observer_at,
                                                   const RobotConstants& other,
                                                   const BodyAt& other_at) {
  namespace at = range_columns;
  const Eigen::Matrix3d R_W_B = observer_at.q_W_B.toRotationMatrix();
  const Eigen::Matrix3d R_W_N = other_at.q_W_B.toRotationMatrix();
  const Eigen::Vector3d way =
      other_at.p_W + R_W_N * other.p_B_U - observer_at.p_W - R_W_B * observer.p_B_U;
  const double distance = way.norm();
  if (distance < kLeastDistance) return std::nullopt;
  // d = | p_N + R_N a_N - p_B - R_B a_B | ,  u its direction:
  // dd = u^T (dp_N - R_N [a_N]x dtheta_N + R_N da_N - dp_B + R_B [a_B]x dtheta_B - R_B da_B)
  const Eigen::RowVector3d u = way.transpose() / distance;
  RangeFactor factor;
  factor.range_m = distance + observer.range_delay_m + other.range_delay_m;
  factor.J.segment<3>(at::kObserver) = u * R_W_B * hat(observer.p_B_U);
  factor.J.segment<3>(at::kObserver + 3) = -u;
  factor.J.segment<3>(at::kOther) = -u * R_W_N * hat(other.p_B_U);
  factor.J.segment<3>(at::kOther + 3) = u;
  factor.J.segment<3>(at::kAntenna) = -u * R_W_B;
  factor.J.segment<3>(at::kOtherAntenna) = u * R_W_N;
  factor.J(at::kDelay) = 1.0;
  factor.J(at::kOtherDelay) = 1.0;
  return factor;
}

}  // namespace crepes
