#include "estimator/relative/neighbor_filter.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>

#include "estimator/core/contract.hpp"
#include "estimator/core/so3.hpp"
#include "estimator/relative/bearing_measurement.hpp"
#include "estimator/relative/parallax.hpp"
#include "estimator/relative/polar_error.hpp"
#include "estimator/relative/pose_measurement.hpp"
#include "estimator/relative/range_update.hpp"

namespace crepes {
namespace {

using E = ErrorState;

// So long after three ranges they hold the distance.
constexpr Duration kRangesLast = std::chrono::milliseconds{500};
// So long after a bearing it holds the direction.
constexpr Duration kSightLasts = std::chrono::milliseconds{500};

ErrorState::Covariance first_covariance(const Matrix6d& pose, double speed_sigma,
                                        const Priors& priors) {
  const auto square = [](double x) { return x * x; };
  E::Covariance P;
  auto seen = P.seen();
  seen.block<3, 3>(E::kP, E::kP) = pose.topLeftCorner<3, 3>();
  seen.block<3, 3>(E::kP, E::kTheta) = pose.topRightCorner<3, 3>();
  seen.block<3, 3>(E::kTheta, E::kP) = pose.bottomLeftCorner<3, 3>();
  seen.block<3, 3>(E::kTheta, E::kTheta) = pose.bottomRightCorner<3, 3>();
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
  P.diagonal()(E::kRangeBias) = square(priors.range_bias_m);
  return P;
}

// Sets the covariance of a raw pose's error with the calibration errors, which are states.
template <int kIndex, class Jacobian>
void set_cross_covariance(const Jacobian& by_state, E::Covariance& P) {
  constexpr int kStates = Jacobian::ColsAtCompileTime;
  const Eigen::Matrix<double, 6, kStates> cross =
      by_state * P.template block<kIndex, kIndex, kStates, kStates>();
  P.template set_symmetric<E::kP, kIndex>(cross.template topRows<3>());
  P.template set_symmetric<E::kTheta, kIndex>(cross.template bottomRows<3>());
}

void set_cross_covariances(const CalibrationJacobian& J, E::Covariance& P) {
  set_cross_covariance<E::kMisalignB>(J.by_misalignment_B, P);
  set_cross_covariance<E::kMisalignN>(J.by_misalignment_N, P);
  set_cross_covariance<E::kAccelB>(J.by_accel_bias_B, P);
  set_cross_covariance<E::kAccelN>(J.by_accel_bias_N, P);
  set_cross_covariance<E::kAccelScaleB>(J.by_accel_scale_B, P);
  set_cross_covariance<E::kAccelScaleN>(J.by_accel_scale_N, P);
  set_cross_covariance<E::kRangeBias>(J.by_range_bias, P);
}

// The covariance of a raw pose, with the tilt errors that the accelerometers' errors cause.
Matrix6d covariance_with_tilt_errors(const RawPose& raw, const Priors& priors) {
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

// Covariance intersection of two estimates with unknown correlation: the weight of the first for
// which the determinant of the result is smallest.
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

// A rotation of all that our camera sees cannot be distinguished from its misalignment m:
//   dp = p x dm,  dv = v x dm,  dtheta = -R^T dm.
Eigen::Matrix<double, E::kMotion, 3> motion_by_misalignment(const RelativeMotion& motion) {
  Eigen::Matrix<double, E::kMotion, 3> by_m;
  by_m << hat(motion.T_B_N.p), hat(motion.v_B_N), -motion.T_B_N.R().transpose();
  return by_m;
}

// Each correction moves the estimate by some noise. If P is not transported, the next update reads
// that motion as information about what bearings cannot observe: the distance, and our camera's
// misalignment. The neighbor's camera does not need this: there dtheta = dm, wherever the neighbor
// is.
void transport_motion(const MotionTransport& T, E::Covariance& P) {
  P.seen_rows<0, E::kMotion>() = (T * P.seen_rows<0, E::kMotion>()).eval();
  const Eigen::Matrix<double, E::kSize, E::kMotion> columns = P.columns<0, E::kMotion>();
  P.columns<0, E::kMotion>().setZero();
  add_product(columns, T, P.columns<0, E::kMotion>());
}

void transport_misalignment(const Eigen::Matrix<double, E::kMotion, 3>& by_m, E::Covariance& P) {
  add_product(P.columns<E::kMisalignB, 3>(), by_m, P.columns<0, E::kMotion>());
  P.seen_rows<0, E::kMotion>() += by_m.lazyProduct(P.seen_rows<E::kMisalignB, 3>());
  auto motion = P.seen().topLeftCorner<E::kMotion, E::kMotion>();
  motion = (0.5 * (motion + motion.transpose())).eval();
}

}  // namespace

NeighborFilter::NeighborFilter(Timestamp stamp, const RawPose& first, const ProcessNoise& noise,
                               const Priors& priors)
    : stamp_(stamp),
      P_(first_covariance(covariance_with_tilt_errors(first, priors), priors.speed_mps, priors)),
      noise_(noise) {
  set_cross_covariances(first.by_calibration, P_);
  state_.motion.T_B_N = first.T_B_N;
}

NeighborFilter::NeighborFilter(Timestamp stamp, const GaussianPose& T_B_N,
                               const ProcessNoise& noise, const Priors& priors)
    : stamp_(stamp),
      P_(first_covariance(T_B_N.covariance, priors.speed_mps, priors)),
      noise_(noise),
      was_seen_by_(false) {
  state_.motion.T_B_N = T_B_N.pose;
}

NeighborFilter::NeighborFilter(Timestamp stamp, const GraphPose& first, const ProcessNoise& noise,
                               const Priors& priors)
    : stamp_(stamp),
      P_(first_covariance(first.T_B_N.covariance, NeighborEstimate::kSpeedSigma, priors)),
      noise_(noise) {
  state_.motion = {first.T_B_N.pose, first.v_B_N};
}

void NeighborFilter::advance_to(Timestamp to, const ImuHistory& imu_B, const ImuHistory& imu_N) {
  CREPES_EXPECT(to >= stamp_, "a filter moves forward only");
  propagate(imu_B, imu_N, stamp_, to, noise_, state_, P_);
  if (held_) held_ = imu_N.rotation(stamp_, to).conjugate() * *held_;
  stamp_ = to;
}

template <class Innovation>
Fusion NeighborFilter::correct(std::optional<Innovation> z, double gate_nis) {
  if (!z) return {};
  auto outcome = kalman_gain(*z, gate_nis, P_);
  const Fusion fusion = fusion_of(*z, outcome);
  if (outcome.verdict != Verdict::kFused) return fusion;
  const auto before = held();
  if (has_ranges()) {
    const E::Vector withheld = withhold_distance(*z, state_.motion.T_B_N.p, P_, outcome);
    correct_covariance(outcome, withheld, P_);
  } else {
    correct_covariance(outcome, P_);
  }
  hold(before, outcome.correction);
  apply(outcome.correction);
  return fusion;
}

std::optional<NeighborFilter::Held> NeighborFilter::held() const {
  if (!held_) return std::nullopt;
  const E::Vector with_turn = P_.columns<E::kTheta, 3>() * *held_;
  const double variance = held_->dot(with_turn.segment<3>(E::kTheta));
  return Held{with_turn / variance, variance};
}

// As Joseph's form gives it for the smaller gain.
void NeighborFilter::hold(const std::optional<Held>& before, E::Vector& correction) {
  if (!before) return;
  const double variance = held_->dot(P_.block<E::kTheta, E::kTheta, 3, 3>() * *held_);
  P_.subtract_outer((variance - before->variance) * before->by_turn, before->by_turn);
  correction -= held_->dot(correction.segment<3>(E::kTheta)) * before->by_turn;
}

void NeighborFilter::apply(const E::Vector& correction) {
  constexpr double kFar = 0.01;  // rad, and of the distance
  const RelativeMotion before = state_.motion;
  inject(correction, state_);
  const bool is_far = correction.segment<3>(E::kTheta).norm() > kFar ||
                      correction.segment<3>(E::kP).norm() > kFar * before.T_B_N.p.norm();
  // Below that, while ranges hold the distance and our camera the direction, P needs no transport:
  // bearings do not correct the distance. If only the neighbor sees us, nobody measures how its
  // frame is turned about us, and P must move with the estimate.
  Eigen::Matrix<double, E::kMotion, 3> by_m = motion_by_misalignment(before);
  if (is_far || !has_ranges() || is_blind()) {
    const MotionTransport T = was_seen_by_ ? error_transport(before, state_.motion)
                                           : error_transport_of_blind(before, state_.motion);
    transport_motion(T, P_);
    by_m = (T * by_m).eval();
  }
  transport_misalignment(motion_by_misalignment(state_.motion) - by_m, P_);
}

bool NeighborFilter::has_ranges() const { return stamp_ < ranges_used_.front() + kRangesLast; }

bool NeighborFilter::is_blind() const { return stamp_ > seen_ + kSightLasts; }

// The error along one attitude axis a correlates with all others: x = g a + rest, g = P a / s^2.
// The parts are spaced along g, with a smaller variance along it.
std::vector<NeighborFilter::Part> NeighborFilter::split() const {
  constexpr double kNarrow = 0.03;  // rad
  constexpr double kSpacing = 1.5;  // in sigmas of a part; no ripple in the sum
  constexpr double kReach = 3.5;    // in sigmas of the whole
  constexpr int kMaxSide = 9;

  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> attitude;
  attitude.computeDirect(P_.block<E::kTheta, E::kTheta, 3, 3>());
  const double variance = attitude.eigenvalues()(2);
  const double sigma = std::sqrt(variance);
  if (!(sigma > kNarrow)) return {{*this}};

  const double narrow = std::max(kNarrow, kReach * sigma / (kSpacing * kMaxSide));
  const double cut = variance - narrow * narrow;  // variance of the centers of the parts
  const int side = static_cast<int>(std::ceil(kReach * std::sqrt(cut) / (kSpacing * narrow)));
  const Eigen::Vector3d axis = attitude.eigenvectors().col(2);
  const E::Vector g = P_.columns<E::kTheta, 3>() * axis / variance;

  std::vector<Part> parts;
  for (int i = -side; i <= side; ++i) {
    const double angle = i * kSpacing * narrow;
    Part part{*this, -0.5 * angle * angle / cut};
    part.filter.P_.subtract_outer(cut * g, g);
    part.filter.apply(angle * g);
    parts.push_back(part);
  }
  return parts;
}

Fusion NeighborFilter::fuse_bearing(const DirectionReading& z, const Eigen::Vector3d& p_N_M,
                                    double gate_nis) {
  const Fusion fusion =
      correct(linearize_bearing(state_, z.u, z.camera, p_N_M, z.sigma_rad), gate_nis);
  if (fusion.verdict == Verdict::kFused) seen_ = stamp_;
  return fusion;
}

Fusion NeighborFilter::fuse_peer_bearing(const DirectionReading& z, const Eigen::Vector3d& p_B_M,
                                         double gate_nis) {
  const Fusion fusion =
      correct(linearize_peer_bearing(state_, z.u, z.camera, p_B_M, z.sigma_rad), gate_nis);
  was_seen_by_ = was_seen_by_ || fusion.verdict == Verdict::kFused;
  return fusion;
}

Fusion NeighborFilter::fuse_range(const RangeReading& z, const Eigen::Vector3d& p_B_U,
                                  const Eigen::Vector3d& p_N_Q, double gate_nis) {
  const auto innovation = linearize_range(state_, p_B_U, p_N_Q, z.range_m, z.sigma_m);
  if (!innovation) return {};
  const double distance_m = z.range_m - state_.range_bias_m - innovation->residual(0);
  const auto before = held();
  RangeUpdate update =
      update_by_range(*innovation, distance_m, gate_nis, P_, z.shared_m * z.shared_m);
  if (update.fusion.verdict != Verdict::kFused) return update.fusion;
  hold(before, update.correction);
  apply(update.correction);
  std::rotate(ranges_used_.begin(), ranges_used_.begin() + 1, ranges_used_.end());
  ranges_used_.back() = stamp_;
  return update.fusion;
}

Fusion NeighborFilter::fuse_ring_distance(const RingReading& z, const Eigen::Vector3d& p_N_M,
                                          double gate_nis) {
  const auto innovation = linearize_ring_distance(state_, z.camera, p_N_M, z.distance_m, z.sigma_m);
  if (!innovation) return {};
  const double distance_m = z.distance_m - innovation->residual(0);
  const double shared_m = kRingScaleSigma * z.distance_m;
  const auto before = held();
  RangeUpdate update = update_by_range(*innovation, distance_m, gate_nis, P_, shared_m * shared_m);
  if (update.fusion.verdict != Verdict::kFused) return update.fusion;
  hold(before, update.correction);
  apply(update.correction);
  return update.fusion;
}

Fusion NeighborFilter::fuse_correlated_pose(const GaussianPose& T_B_N, double gate_nis) {
  const double own = intersection_weight(pose_covariance(), T_B_N.covariance);
  if (own == 1.0) return {.verdict = Verdict::kFused};
  const E::Covariance before = P_;
  P_.seen_rows<0, E::kMotion>() /= std::sqrt(own);
  P_.columns<0, E::kMotion>() /= std::sqrt(own);
  const GaussianPose discounted{T_B_N.pose, T_B_N.covariance / (1.0 - own)};
  const auto z = linearize_pose(state_, discounted);
  const auto outcome = kalman_update(z, gate_nis, P_);
  if (outcome.verdict == Verdict::kFused) {
    apply(outcome.correction);
  } else {
    P_ = before;
  }
  return fusion_of(z, outcome);
}

void NeighborFilter::reset_distance(double sigma_m, const Priors& priors) {
  const Eigen::Vector3d v_B_N = state_.motion.v_B_N;
  const Eigen::Vector3d u = state_.motion.T_B_N.p.normalized();
  GaussianPose known{state_.motion.T_B_N, pose_covariance()};
  known.covariance.topLeftCorner<3, 3>() += sigma_m * sigma_m * u * u.transpose();
  const bool was_seen_by = was_seen_by_;
  *this = NeighborFilter(stamp_, known, noise_, priors);
  state_.motion.v_B_N = v_B_N;
  was_seen_by_ = was_seen_by;
}

void NeighborFilter::reset_misalignment(MeasurementKind kind, double misalignment_rad) {
  const bool ours = kind == MeasurementKind::kBearing;
  const double variance = misalignment_rad * misalignment_rad;
  if (ours) {
    state_.misalignment_B.setZero();
    P_.set_independent<E::kMisalignB, 3>(variance);
  } else {
    state_.misalignment_N.setZero();
    P_.set_independent<E::kMisalignN, 3>(variance);
  }
}

Matrix6d NeighborFilter::pose_covariance() const {
  Matrix6d covariance;
  covariance << P_.block<E::kP, E::kP, 3, 3>(), P_.block<E::kP, E::kTheta, 3, 3>(),
      P_.block<E::kTheta, E::kP, 3, 3>(), P_.block<E::kTheta, E::kTheta, 3, 3>();
  return covariance;
}

}  // namespace crepes
