#include "estimator/relative/neighbor_filter.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <type_traits>

#include "estimator/core/contract.hpp"
#include "estimator/core/so3.hpp"
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
  for (const int scale : {E::kGyroScaleB, E::kGyroScaleN})
    P.diagonal().segment<9>(scale).setConstant(square(priors.gyro_scale));
  for (const int scale : {E::kAccelScaleB, E::kAccelScaleN})
    P.diagonal().segment<9>(scale).setConstant(square(priors.accel_scale));
  P(E::kRangeBias, E::kRangeBias) = square(priors.range_bias_m);
  return P;
}

// How a raw pose's error goes with the errors of calibration, which are states.
void correlate(const CalibrationJacobian& J, E::Covariance& P) {
  const auto add = [&P](const auto& by_state, int index) {
    constexpr int kStates = std::decay_t<decltype(by_state)>::ColsAtCompileTime;
    const Eigen::Matrix<double, 6, kStates> cross =
        by_state * P.template block<kStates, kStates>(index, index);
    P.template block<3, kStates>(E::kP, index) = cross.template topRows<3>();
    P.template block<3, kStates>(E::kTheta, index) = cross.template bottomRows<3>();
    P.template block<kStates, 3>(index, E::kP) = cross.template topRows<3>().transpose();
    P.template block<kStates, 3>(index, E::kTheta) = cross.template bottomRows<3>().transpose();
  };
  add(J.by_misalignment_B, E::kMisalignB);
  add(J.by_misalignment_N, E::kMisalignN);
  add(J.by_accel_bias_B, E::kAccelB);
  add(J.by_accel_bias_N, E::kAccelN);
  add(J.by_accel_scale_B, E::kAccelScaleB);
  add(J.by_accel_scale_N, E::kAccelScaleN);
  add(J.by_range_bias, E::kRangeBias);
}

// With the tilt of accelerometers that are not quite right.
Matrix6d tilted_covariance(const RawPose& raw, const Priors& priors) {
  Matrix6d covariance = raw.gaussian().covariance;
  const auto add = [&](const auto& by_state, double sigma) {
    covariance += sigma * sigma * by_state * by_state.transpose();
  };
  const CalibrationJacobian& J = raw.by_calibration;
  add(J.by_accel_bias_B, priors.accel_bias_mps2);
  add(J.by_accel_bias_N, priors.accel_bias_mps2);
  add(J.by_accel_scale_B, priors.accel_scale);
  add(J.by_accel_scale_N, priors.accel_scale);
  return covariance;
}

// How much two estimates whose errors go together, nobody knows how much, should each count: the
// weight of the first for which the intersection of both is smallest.
double intersection_weight(const Matrix6d& first, const Matrix6d& second) {
  constexpr int kSteps = 20;
  const Matrix6d A = first.inverse();
  const Matrix6d B = second.inverse();
  double best = 1.0;
  double most = A.determinant();
  for (int i = 1; i < kSteps; ++i) {
    const double weight = static_cast<double>(i) / kSteps;
    const double information = (weight * A + (1.0 - weight) * B).determinant();
    if (information > most) {
      most = information;
      best = weight;
    }
  }
  return best;
}

/// P once three errors are J times what they were.
void map_errors(int index, const Eigen::Matrix3d& J, E::Covariance& P) {
  auto rows = P.block<3, E::kSeen>(index, 0);
  rows = (J * rows).eval();
  P.middleCols<3>(index) = (P.middleCols<3>(index) * J.transpose()).eval();
}

// P of the error at the corrected state: theta_new = J_r(theta) (theta - theta_hat).
void reset(const Eigen::Matrix3d& J_r, E::Covariance& P) { map_errors(E::kTheta, J_r, P); }

// What a bearing cannot see must stay unseen. Distance and range bias are known only together, so P
// is long along the line of sight; each bearing turns that line by microradians and, P lying as
// before, the next innovation would pass for news of the distance: robots at rest drift apart. So P
// is turned until this bearing says nothing of the range's bias, as far as the estimate's unrest
// explains it; what shows because robots moved, a parallax, is much more and stays. Compare Huang,
// Mourikis and Roumeliotis 2010: an unobservable direction has to be one at every linearization.
Eigen::Matrix3d turn_to_sight(const BearingInnovation& z, const E::Covariance& P) {
  constexpr double kUnrest = 3e-4;  // rad
  const Eigen::Vector3d along = P.block<3, 1>(E::kP, E::kRangeBias);
  const Eigen::Matrix<double, 2, 3> by_p = z.H.middleCols<3>(E::kP);
  const Eigen::Vector2d seen = z.H.lazyProduct(P.col(E::kRangeBias).head<E::kSeen>());
  const Eigen::Matrix2d across = by_p * by_p.transpose();
  const Eigen::Vector3d aside = -by_p.transpose() * across.inverse() * seen;
  const double length2 = along.squaredNorm();
  if (!(aside.squaredNorm() < 0.01 * length2)) return Eigen::Matrix3d::Identity();  // not yet
  const double share = kUnrest * kUnrest / (kUnrest * kUnrest + aside.squaredNorm() / length2);
  return so3_exp(share / length2 * along.cross(aside)).toRotationMatrix();
}

// What an update asks for, once P's errors of position are `turn` times what they were.
template <int M>
void turn_outcome(const Eigen::Matrix3d& turn, UpdateOutcome<M, E::kSize>& outcome) {
  const auto apply = [&turn](auto&& rows) { rows = (turn * rows).eval(); };
  apply(outcome.correction.template segment<3>(E::kP));
  apply(outcome.G.template middleRows<3>(E::kP));
}

// A turn of everything that our camera sees looks like its misalignment:
//   dp = p x dm,  dv = v x dm,  dtheta = -R^T dm.
// Each correction moves p, v and R by some noise; P lying as before, the next one would learn dm
// from that. So P goes along, as if in coordinates in which bearings do not see dm at all (compare
// Barrau and Bonnabel 2015, and Huang, Mourikis and Roumeliotis 2010). The neighbor's camera needs
// nothing of the kind: there it is dtheta = dm, wherever the neighbor is.
void carry_misalignment(const RelativeMotion& before, const RelativeMotion& after,
                        E::Covariance& P) {
  Eigen::Matrix<double, E::kMotion, 3> by_m;
  by_m << hat(after.T_B_N.p - before.T_B_N.p), hat(after.v_B_N - before.v_B_N),
      (before.T_B_N.R() - after.T_B_N.R()).transpose();
  add_product(P.middleCols<3>(E::kMisalignB), by_m, P.leftCols<E::kMotion>());
  P.block<E::kMotion, E::kSeen>(0, 0) += by_m.lazyProduct(P.block<3, E::kSeen>(E::kMisalignB, 0));
  auto motion = P.topLeftCorner<E::kMotion, E::kMotion>();
  motion = (0.5 * (motion + motion.transpose())).eval();
}

}  // namespace

NeighborFilter::NeighborFilter(Timestamp stamp, const RawPose& first, const ProcessNoise& noise,
                               const Priors& priors)
    : stamp_(stamp),
      P_(first_covariance(tilted_covariance(first, priors), priors.speed_mps, priors)),
      noise_(noise) {
  correlate(first.by_calibration, P_);
  state_.motion.T_B_N = first.T_B_N;
}

NeighborFilter::NeighborFilter(Timestamp stamp, const GaussianPose& T_B_N,
                               const ProcessNoise& noise, const Priors& priors)
    : stamp_(stamp),
      P_(first_covariance(T_B_N.covariance, priors.speed_mps, priors)),
      noise_(noise) {
  state_.motion.T_B_N = T_B_N.pose;
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

// An update that moves the state far is done again, linearized where it leads to (iterated Kalman
// filter, Bell and Cathey 1993). A first pose is off by degrees and a bearing is not: with the
// first linearization alone, what the bearing does not see, the roll about the line of sight, would
// come out as known from the next bearing on.
template <class Linearize>
Fusion NeighborFilter::correct(const Linearize& linearize, double gate_nis) {
  // rad, and of the distance; half its square is well below any bearing's noise.
  constexpr double kLinear = 0.01;
  constexpr int kMaxIterations = 5;

  auto z = linearize(state_);
  if (!z) return {};
  constexpr bool kIsBearing = std::is_same_v<std::decay_t<decltype(*z)>, BearingInnovation>;
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  if constexpr (kIsBearing) {
    turn = turn_to_sight(*z, P_);
    z->H.template middleCols<3>(E::kP) *= turn;  // as good as turning P, which a gate may forbid
  }
  auto outcome = kalman_gain(*z, gate_nis, P_);
  const Fusion fusion = fusion_of(*z, outcome);
  if (outcome.verdict != Verdict::kFused) return fusion;
  if constexpr (kIsBearing) {
    map_errors(E::kP, turn, P_);
    turn_outcome(turn, outcome);
  }

  Eigen::Vector3d theta = outcome.correction.template segment<3>(E::kTheta);
  const double shift = outcome.correction.template segment<3>(E::kP).norm();
  const bool is_far = theta.norm() > kLinear || shift > kLinear * state_.motion.T_B_N.p.norm();
  for (int i = 0; is_far && i < kMaxIterations; ++i) {
    NominalState there = state_;
    inject(outcome.correction, there);
    z = linearize(there);
    if (!z) return {};
    z->H.template middleCols<3>(E::kTheta) =
        (z->H.template middleCols<3>(E::kTheta) * so3_right_jacobian(theta)).eval();
    z->residual += z->H * outcome.correction.template head<E::kSeen>();
    outcome = kalman_gain(*z, std::numeric_limits<double>::infinity(), P_);
    theta = outcome.correction.template segment<3>(E::kTheta);
  }
  correct_covariance<E::kSeen>(outcome, P_);
  if (is_far) reset(so3_right_jacobian(theta), P_);
  const RelativeMotion before = state_.motion;
  inject(outcome.correction, state_);
  carry_misalignment(before, state_.motion, P_);
  return fusion;
}

// The error along one axis of the attitude, a, takes the others with it: x = g a + rest, g = P a /
// s^2. Parts are moved along g, and narrower in it.
std::vector<NeighborFilter::Part> NeighborFilter::split() const {
  constexpr double kNarrow = 0.03;  // rad
  constexpr double kSpacing = 1.5;  // in sigmas of a part: without a ripple in their sum
  constexpr double kReach = 3.5;    // in sigmas of the whole
  constexpr int kMaxSide = 9;

  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> attitude;
  attitude.computeDirect(P_.block<3, 3>(E::kTheta, E::kTheta));
  const double variance = attitude.eigenvalues()(2);
  const double sigma = std::sqrt(variance);
  if (!(sigma > kNarrow)) return {{*this}};

  const double narrow = std::max(kNarrow, kReach * sigma / (kSpacing * kMaxSide));
  const double cut = variance - narrow * narrow;  // variance of the parts' centers
  const int side = static_cast<int>(std::ceil(kReach * std::sqrt(cut) / (kSpacing * narrow)));
  const Eigen::Vector3d axis = attitude.eigenvectors().col(2);
  const E::Vector g = P_.middleCols<3>(E::kTheta) * axis / variance;

  std::vector<Part> parts;
  for (int i = -side; i <= side; ++i) {
    const double angle = i * kSpacing * narrow;
    Part part{*this, -0.5 * angle * angle / cut};
    part.filter.P_ -= cut * g * g.transpose();
    reset(so3_right_jacobian(angle * axis), part.filter.P_);
    inject(angle * g, part.filter.state_);
    parts.push_back(part);
  }
  return parts;
}

Fusion NeighborFilter::fuse_bearing(const DirectionReading& z, const Eigen::Vector3d& p_N_M,
                                    double gate_nis) {
  return correct(
      [&](const NominalState& state) {
        return linearize_bearing(state, z.u, z.camera, p_N_M, z.sigma_rad);
      },
      gate_nis);
}

Fusion NeighborFilter::fuse_peer_bearing(const DirectionReading& z, const Eigen::Vector3d& p_B_M,
                                         double gate_nis) {
  return correct(
      [&](const NominalState& state) {
        return linearize_peer_bearing(state, z.u, z.camera, p_B_M, z.sigma_rad);
      },
      gate_nis);
}

Fusion NeighborFilter::fuse_range(const RangeReading& z, const Eigen::Vector3d& p_B_U,
                                  const Eigen::Vector3d& p_N_Q, double gate_nis) {
  return correct(
      [&](const NominalState& state) {
        return linearize_range(state, p_B_U, p_N_Q, z.range_m, z.sigma_m);
      },
      gate_nis);
}

Fusion NeighborFilter::fuse_correlated_pose(const GaussianPose& T_B_N, double gate_nis) {
  const double own = intersection_weight(pose_covariance(), T_B_N.covariance);
  if (own == 1.0) return {.verdict = Verdict::kFused};
  const E::Covariance before = P_;
  P_.block<E::kMotion, E::kSeen>(0, 0) /= std::sqrt(own);
  P_.leftCols<E::kMotion>() /= std::sqrt(own);
  const GaussianPose discounted{T_B_N.pose, T_B_N.covariance / (1.0 - own)};
  const Fusion fusion = correct(
      [&](const NominalState& state) { return std::optional(linearize_pose(state, discounted)); },
      gate_nis);
  if (fusion.verdict != Verdict::kFused) P_ = before;
  return fusion;
}

void NeighborFilter::forget_distance(double sigma_m, const Priors& priors) {
  const Eigen::Vector3d v_B_N = state_.motion.v_B_N;
  const Eigen::Vector3d u = state_.motion.T_B_N.p.normalized();
  GaussianPose known{state_.motion.T_B_N, pose_covariance()};
  known.covariance.topLeftCorner<3, 3>() += sigma_m * sigma_m * u * u.transpose();
  *this = NeighborFilter(stamp_, known, noise_, priors);
  state_.motion.v_B_N = v_B_N;
}

void NeighborFilter::change_camera(MeasurementKind kind, double misalignment_rad) {
  const bool ours = kind == MeasurementKind::kBearing;
  const int index = ours ? E::kMisalignB : E::kMisalignN;
  (ours ? state_.misalignment_B : state_.misalignment_N).setZero();
  P_.middleRows<3>(index).setZero();
  P_.middleCols<3>(index).setZero();
  P_.diagonal().segment<3>(index).setConstant(misalignment_rad * misalignment_rad);
}

ErrorState::Covariance NeighborFilter::covariance() const {
  return P_.selfadjointView<Eigen::Lower>();
}

Matrix6d NeighborFilter::pose_covariance() const {
  Matrix6d covariance;
  covariance << P_.block<3, 3>(E::kP, E::kP), P_.block<3, 3>(E::kP, E::kTheta),
      P_.block<3, 3>(E::kTheta, E::kP), P_.block<3, 3>(E::kTheta, E::kTheta);
  return covariance;
}

}  // namespace crepes
