#include "estimator/team/unseen/range_fit.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

constexpr double kHuber = 3.0;                      // sigmas
constexpr double kMostOutliers = 0.1;               // of the ranges, beyond that
constexpr double kMostBeaconError = 2.0;            // sigmas; only ranges through things err more
constexpr double kMostImuError = 4.0;               // sigmas
constexpr double kMostChi2 = 1.5;                   // a range
constexpr double kLeastForce = 0.5 * kGravityMps2;  // mean specific force that shows what is up
constexpr double kUpright = 0.5;                    // cosine between what is up for two robots
constexpr int kFitIterations = 20;
constexpr double kFitted = 1e-3;  // rad, m, m/s
constexpr double kTooNear = 0.1;  // m; antennas are not nearer
constexpr double kTwoImus = 2.0;  // of the same noise

}  // namespace

RangeFit::RangeFit(const RangeProblem& problem, const RangeTrack& track,
                   const std::optional<Eigen::Quaterniond>& attitude)
    : problem_(&problem),
      start_(motion_along(track, problem.by_imu,
                          attitude ? *attitude : attitude_along(track, problem.by_imu))),
      errors_(Eigen::VectorXd::Zero(problem.prior.size())) {
  for (int i = 0; linearize() && !is_converged_ && i < kFitIterations; ++i) {
    const Eigen::VectorXd step = factors_.solve(gradient_);
    is_converged_ = step.head<CarriedMotion::kMotion>().norm() < kFitted;
    apply(step);
  }
}

RangeTrack RangeFit::track() const {
  RangeTrack track = problem_->by_imu;
  for (TrackPoint& point : track)
    point.p = start_.p_F + point.t_s * start_.v_F + start_.q_F_B * point.p;
  return track;
}

Eigen::Quaterniond RangeFit::turned(double angle) const {
  const Eigen::Vector3d up = (end_.motion.v_F - start_.v_F).normalized();
  return (so3_exp(angle * up) * start_.q_F_B).normalized();
}

double RangeFit::cost() const {
  const Eigen::Vector3d own = problem_->self_end.motion.v_F / end_.t_s;
  const Eigen::Vector3d other = (end_.motion.v_F - start_.v_F) / end_.t_s;
  const bool is_upright = std::min(own.norm(), other.norm()) < kLeastForce ||
                          own.dot(other) >= kUpright * own.norm() * other.norm();
  return is_upright ? cost_ : std::numeric_limits<double>::infinity();
}

bool RangeFit::is_consistent() const {
  const auto n = static_cast<double>(problem_->ranges.size());
  const Eigen::VectorXd sigmas = errors_.cwiseAbs().cwiseProduct(problem_->prior.cwiseSqrt());
  const bool is_likely =
      sigmas.head<CarriedMotion::kStart>().maxCoeff() <= kMostImuError &&
      sigmas.tail(sigmas.size() - CarriedMotion::kStart).maxCoeff() <= kMostBeaconError;
  return is_converged_ && is_likely && cost() <= kMostChi2 * n &&
         static_cast<double>(outliers_) <= kMostOutliers * n;
}

TeamPlace RangeFit::place() const {
  const FreeMotion& here = problem_->self_end.motion;
  const FreeMotion& there = end_.motion;
  const Eigen::Quaterniond q_B_F = here.q_F_B.conjugate();
  TeamPlace place{.T_S_N = {q_B_F * (there.p_F - here.p_F), (q_B_F * there.q_F_B).normalized()},
                  .v_S_N = q_B_F * (there.v_F - here.v_F)};
  const Eigen::MatrixXd all =
      factors_.solve(Eigen::MatrixXd::Identity(errors_.size(), errors_.size()));
  MotionMatrix turn = MotionMatrix::Identity();
  turn.block<3, 3>(0, 0) = q_B_F.toRotationMatrix();
  turn.block<3, 3>(3, 3) = q_B_F.toRotationMatrix();
  Eigen::Matrix<double, CarriedMotion::kMotion, CarriedMotion::kStart> by_start;
  by_start << turn.lazyProduct(by_earlier(start_, there, end_.t_s)),
      turn.lazyProduct(end_.by_errors);
  const Eigen::Matrix<double, CarriedMotion::kMotion, CarriedMotion::kStart> carried =
      by_start * all.topLeftCorner<CarriedMotion::kStart, CarriedMotion::kStart>();
  const MotionMatrix noise = turn.lazyProduct(end_.noise + problem_->self_end.noise);
  place.covariance = carried.lazyProduct(by_start.transpose());
  place.covariance += noise.lazyProduct(turn.transpose());
  return place;
}

ImuErrors RangeFit::imu_errors() const {
  return errors_.segment<CarriedMotion::kErrors>(CarriedMotion::kMotion);
}

bool RangeFit::linearize() {
  const Eigen::VectorXd& prior = problem_->prior;
  information_ = prior.asDiagonal();
  gradient_ = -prior.cwiseProduct(errors_);
  cost_ = errors_.dot(prior.cwiseProduct(errors_));
  outliers_ = 0;
  for (const FittedRange& z : problem_->ranges) add(z);
  end_ = problem_->end.started_at(start_, imu_errors());
  factors_.compute(information_);
  const bool is_solved = factors_.info() == Eigen::Success && std::isfinite(cost_);
  if (!is_solved) cost_ = std::numeric_limits<double>::infinity();
  return is_solved;
}

void RangeFit::add(const FittedRange& z) {
  constexpr int kStart = CarriedMotion::kStart;
  const ImuErrors errors = imu_errors();
  const Eigen::Quaterniond q = z.q * so3_exp(z.theta_by_errors * errors);
  const Eigen::Vector3d antenna = z.p + z.p_by_errors * errors + q * problem_->p_body_uwb;
  const Eigen::Vector3d d = start_.p_F + z.t_s * start_.v_F + start_.q_F_B * antenna - z.p_F_beacon;
  const double distance = std::max(d.norm(), kTooNear);
  const Eigen::Vector3d u = d / distance;
  const Eigen::Vector3d u_start = start_.q_F_B.conjugate() * u;
  const Eigen::Vector3d by_turn = problem_->p_body_uwb.cross(q.conjugate() * u_start);
  Eigen::Matrix<double, kStart, 1> row;
  row << u, z.t_s * u, antenna.cross(u_start),
      z.p_by_errors.transpose() * u_start + z.theta_by_errors.transpose() * by_turn;

  const double residual = z.reading.range_m - distance - errors_(z.error);
  const double variance =
      z.reading.sigma_m * z.reading.sigma_m + kTwoImus * u_start.dot(z.p_noise * u_start);
  const double sigmas = std::abs(residual) / std::sqrt(variance);
  const bool is_outlier = sigmas > kHuber;
  outliers_ += is_outlier ? 1 : 0;
  cost_ += is_outlier ? kHuber * (2.0 * sigmas - kHuber) : sigmas * sigmas;
  const double weight = (is_outlier ? kHuber / sigmas : 1.0) / variance;
  const Eigen::Matrix<double, kStart, 1> weighed = weight * row;
  information_.topLeftCorner<kStart, kStart>() += weighed.lazyProduct(row.transpose());
  information_.block<1, kStart>(z.error, 0) += weighed.transpose();  // the lower half is enough
  information_(z.error, z.error) += weight;
  gradient_.head<kStart>() += residual * weighed;
  gradient_(z.error) += weight * residual;
}

void RangeFit::apply(const Eigen::VectorXd& step) {
  start_.p_F += step.head<3>();
  start_.v_F += step.segment<3>(3);
  start_.q_F_B = (start_.q_F_B * so3_exp(step.segment<3>(6))).normalized();
  errors_ += step;
  errors_.head<CarriedMotion::kMotion>().setZero();
}

}  // namespace crepes
