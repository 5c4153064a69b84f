#include "estimator/team/range_place.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <numbers>
#include <utility>

#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"
#include "estimator/team/range_track.hpp"

namespace crepes {
namespace {

constexpr std::size_t kLeastSpheres = 4;
constexpr std::size_t kLeastTrack = 10;  // intervals with so many
// What hides a robot from all cameras may lengthen its ranges, for as long as it does.
constexpr double kHiddenSigma = 0.15;           // m; of a beacon's ranges together
constexpr double kHuber = 3.0;                  // sigmas
constexpr double kMostOutliers = 0.1;           // of the ranges, beyond that
constexpr double kMostBeaconError = 2.0;        // sigmas; only ranges through things err more
constexpr double kMostImuError = 4.0;           // sigmas
constexpr double kMostChi2 = 1.5;               // a range
constexpr double kMostPosition = 0.7;           // m; sigma of its place
constexpr double kMostAttitude = radians(8.0);  // rad; sigma about any axis
constexpr double kClearChi2 = 25.0;             // by which another place is less likely
constexpr double kNear = 1.0;                   // m
constexpr double kNearAttitude = radians(15.0);
constexpr double kLeastForce = 0.5 * kGravityMps2;  // mean specific force that shows what is up
constexpr double kUpright = 0.5;                    // cosine between what is up for two robots
constexpr int kFitIterations = 20;
constexpr double kFitted = 1e-3;  // rad, m, m/s
constexpr double kTooNear = 0.1;  // m; antennas are not nearer
constexpr double kTwoImus = 2.0;  // of the same noise

/// Of the IMU: its biases, and its gyroscope's scale errors.
using ImuErrors = Eigen::Matrix<double, FreeMotionAt::kBias, 1>;

/// A motion with its derivative by the motion at the first beginning and by the IMU's errors.
struct CarriedMotion {
  static constexpr int kMotion = FreeMotionAt::kMotion;
  static constexpr int kStart = FreeMotionAt::kStart;
  static constexpr int kErrors = FreeMotionAt::kBias;

  double t_s = 0.0;
  FreeMotion motion{};
  Eigen::Matrix<double, kMotion, kStart> by_start =
      Eigen::Matrix<double, kMotion, kStart>::Identity();
  TeamPlace::Covariance noise = TeamPlace::Covariance::Zero();

  /// At a point of a trajectory that begins here.
  [[nodiscard]] CarriedMotion followed_by(const FreeMotionAt& piece) const {
    CarriedMotion next{.t_s = t_s + piece.t_s, .motion = piece.motion};
    const TeamPlace::Covariance by_motion = piece.by_start.leftCols<kMotion>();
    next.by_start = by_motion.lazyProduct(by_start);
    next.by_start.rightCols<kErrors>() += piece.by_start.rightCols<kErrors>();
    const TeamPlace::Covariance carried = by_motion.lazyProduct(noise);
    next.noise = carried.lazyProduct(by_motion.transpose());
    next.noise += piece.noise;
    return next;
  }

  /// The same from another start than rest at the origin, and with errors of the IMU
  /// (preintegration: Forster et al. 2017, with its bias correction).
  [[nodiscard]] CarriedMotion started_at(const FreeMotion& start, const ImuErrors& errors) const {
    const Eigen::Matrix<double, kMotion, kErrors> by_errors = by_start.rightCols<kErrors>();
    const Eigen::Matrix<double, kMotion, 1> step = by_errors * errors;
    const Eigen::Matrix3d R = start.R();
    const Eigen::Vector3d p = motion.p_F + step.head<3>();
    const Eigen::Vector3d v = motion.v_F + step.segment<3>(3);
    const Eigen::Quaterniond q = motion.q_F_B * so3_exp(step.tail<3>());
    CarriedMotion carried{.t_s = t_s,
                          .motion = {start.p_F + t_s * start.v_F + R * p, start.v_F + R * v,
                                     (start.q_F_B * q).normalized()}};
    TeamPlace::Covariance turn = TeamPlace::Covariance::Identity();
    turn.block<3, 3>(0, 0) = R;
    turn.block<3, 3>(3, 3) = R;
    carried.by_start.block<3, 3>(0, 3) = t_s * Eigen::Matrix3d::Identity();
    carried.by_start.block<3, 3>(0, 6) = -R * hat(p);
    carried.by_start.block<3, 3>(3, 6) = -R * hat(v);
    carried.by_start.block<3, 3>(6, 6) = q.conjugate().toRotationMatrix();
    carried.by_start.rightCols<kErrors>() = turn.lazyProduct(by_errors);
    const TeamPlace::Covariance turned = turn.lazyProduct(noise);
    carried.noise = turned.lazyProduct(turn.transpose());
    return carried;
  }
};

/// A range, and all of it that does not change from one fit to the next: the IMU's path begins at
/// rest at the origin.
struct FittedRange {
  RangeReading reading;
  Eigen::Vector3d p_F_beacon;  ///< in the frame of the first interval
  int error = 0;               ///< index of the beacon's
  double t_s = 0.0;
  Eigen::Vector3d p;
  Eigen::Quaterniond q;
  Eigen::Matrix<double, 3, CarriedMotion::kErrors> p_by_errors;
  Eigen::Matrix<double, 3, CarriedMotion::kErrors> theta_by_errors;
  Eigen::Matrix3d p_noise;

  FittedRange(const RangeReading& range, Eigen::Vector3d beacon, int index,
              const CarriedMotion& path)
      : reading(range),
        p_F_beacon(std::move(beacon)),
        error(index),
        t_s(path.t_s),
        p(path.motion.p_F),
        q(path.motion.q_F_B),
        p_by_errors(path.by_start.topRightCorner<3, CarriedMotion::kErrors>()),
        theta_by_errors(path.by_start.bottomRightCorner<3, CarriedMotion::kErrors>()),
        p_noise(path.noise.topLeftCorner<3, 3>()) {}
};

/// All ranges of the intervals, with both robots' paths, in the frame of the first interval. A
/// robot's path is by its IMU alone.
class RangeProblem {
 public:
  RangeProblem(const std::deque<UnseenInterval>& intervals, const RangePlaceSettings& settings)
      : p_body_uwb(settings.p_body_uwb) {
    std::map<RobotId, double> beacons;
    std::size_t count = 0;
    for (const UnseenInterval& interval : intervals) {
      count += interval.ranges.size();
      for (const BeaconRange& z : interval.ranges) {
        double& variance = beacons[z.beacon];
        variance = std::max(variance, z.beacon_variance_m2);
      }
    }
    ranges.reserve(count);
    for (const UnseenInterval& interval : intervals) add(interval, beacons, settings);
    prior = prior_information(beacons, settings);
  }

  /// Where this path has the antenna.
  [[nodiscard]] Eigen::Vector3d antenna(const FreeMotion& motion) const {
    return motion.p_F + motion.q_F_B * p_body_uwb;
  }

  Eigen::Vector3d p_body_uwb;
  std::vector<FittedRange> ranges;
  std::vector<RangeSpheres> spheres;  ///< of intervals with enough
  RangeTrack by_imu;                  ///< the antenna's path at the same times
  CarriedMotion end;                  ///< of the robot
  CarriedMotion self_end;
  Eigen::VectorXd prior;  ///< information about [motion, IMU's errors, beacons' errors]

 private:
  void add(const UnseenInterval& interval, const std::map<RobotId, double>& beacons,
           const RangePlaceSettings& settings) {
    const RobotTrajectory piece(end.motion, {}, interval.imu, interval.duration_s, settings.noise);
    const FreeMotion self = self_end.motion;
    std::map<RobotId, std::pair<Eigen::Vector3d, double>> latest;
    double mean_s = 0.0;
    for (const BeaconRange& z : interval.ranges) {
      const Eigen::Vector3d p_F_beacon = self.p_F + z.t_s * self.v_F + self.q_F_B * z.p_F_beacon;
      const auto error = std::distance(beacons.begin(), beacons.find(z.beacon));
      ranges.emplace_back(z.reading, p_F_beacon, CarriedMotion::kStart + static_cast<int>(error),
                          end.followed_by(piece.at(z.t_s)));
      latest[z.beacon] = {p_F_beacon, z.reading.range_m};
      mean_s += z.t_s / static_cast<double>(interval.ranges.size());
    }
    if (latest.size() >= kLeastSpheres) {
      spheres.push_back({end.t_s + mean_s, {}});
      for (const auto& [beacon, sphere] : latest) spheres.back().spheres.push_back(sphere);
      by_imu.push_back({end.t_s + mean_s, antenna(piece.motion_at(mean_s))});
    }
    end = end.followed_by(piece.end());
    const RobotTrajectory self_piece(self, settings.self_bias, interval.self_imu,
                                     interval.duration_s, settings.noise);
    self_end = self_end.followed_by(self_piece.end());
  }

  /// Of errors, which are expected to be zero; none of the motion.
  static Eigen::VectorXd prior_information(const std::map<RobotId, double>& beacons,
                                           const RangePlaceSettings& settings) {
    constexpr int kErrors = CarriedMotion::kMotion;
    const Priors& priors = settings.priors;
    Eigen::VectorXd variance = Eigen::VectorXd::Ones(CarriedMotion::kStart + std::ssize(beacons));
    variance.segment<3>(kErrors).setConstant(priors.gyro_bias_radps * priors.gyro_bias_radps +
                                             settings.self_gyro_variance);
    variance.segment<3>(kErrors + 3)
        .setConstant(accel_bias_variance(priors) + settings.self_accel_variance);
    variance.segment<9>(kErrors + 6).setConstant(priors.gyro_scale * priors.gyro_scale);
    int index = CarriedMotion::kStart;
    for (const auto& [beacon, of_beacon] : beacons) {
      variance(index++) =
          kHiddenSigma * kHiddenSigma + priors.range_bias_m * priors.range_bias_m + of_beacon;
    }
    Eigen::VectorXd information = variance.cwiseMax(TeamBelief::kLeastVariance).cwiseInverse();
    information.head<CarriedMotion::kMotion>().setZero();
    return information;
  }
};

/// Least squares over all ranges from one start on.
class RangeFit {
 public:
  /// From the attitude in which the IMU's path bends like the track, or a given one.
  RangeFit(const RangeProblem& problem, const RangeTrack& track,
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

  /// What was found, but for the IMU's errors.
  [[nodiscard]] RangeTrack track() const {
    RangeTrack track = problem_->by_imu;
    for (TrackPoint& point : track)
      point.p = start_.p_F + point.t_s * start_.v_F + start_.q_F_B * point.p;
    return track;
  }
  /// The attitude at the first beginning, turned about what is up.
  [[nodiscard]] Eigen::Quaterniond turned(double angle) const {
    const Eigen::Vector3d up = (end_.motion.v_F - start_.v_F).normalized();
    return (so3_exp(angle * up) * start_.q_F_B).normalized();
  }
  /// Infinite if there is no solution, or if the robot flies upside down: what is up for self is so
  /// for the robot.
  [[nodiscard]] double cost() const {
    const Eigen::Vector3d own = problem_->self_end.motion.v_F / end_.t_s;
    const Eigen::Vector3d other = (end_.motion.v_F - start_.v_F) / end_.t_s;
    const bool is_upright = std::min(own.norm(), other.norm()) < kLeastForce ||
                            own.dot(other) >= kUpright * own.norm() * other.norm();
    return is_upright ? cost_ : std::numeric_limits<double>::infinity();
  }
  [[nodiscard]] bool is_consistent() const {
    const auto n = static_cast<double>(problem_->ranges.size());
    const Eigen::VectorXd sigmas = errors_.cwiseAbs().cwiseProduct(problem_->prior.cwiseSqrt());
    const bool is_likely =
        sigmas.head<CarriedMotion::kStart>().maxCoeff() <= kMostImuError &&
        sigmas.tail(sigmas.size() - CarriedMotion::kStart).maxCoeff() <= kMostBeaconError;
    return is_converged_ && is_likely && cost() <= kMostChi2 * n &&
           static_cast<double>(outliers_) <= kMostOutliers * n;
  }
  /// At the end, in the frame that then falls freely with self, with the noise of both IMUs.
  [[nodiscard]] TeamPlace place() const {
    const FreeMotion& here = problem_->self_end.motion;
    const FreeMotion& there = end_.motion;
    const Eigen::Quaterniond q_B_F = here.q_F_B.conjugate();
    TeamPlace place{.T_S_N = {q_B_F * (there.p_F - here.p_F), (q_B_F * there.q_F_B).normalized()},
                    .v_S_N = q_B_F * (there.v_F - here.v_F)};
    const Eigen::MatrixXd all =
        factors_.solve(Eigen::MatrixXd::Identity(errors_.size(), errors_.size()));
    TeamPlace::Covariance turn = TeamPlace::Covariance::Identity();
    turn.block<3, 3>(0, 0) = q_B_F.toRotationMatrix();
    turn.block<3, 3>(3, 3) = q_B_F.toRotationMatrix();
    const Eigen::Matrix<double, CarriedMotion::kMotion, CarriedMotion::kStart> by_start =
        turn.lazyProduct(end_.by_start);
    const Eigen::Matrix<double, CarriedMotion::kMotion, CarriedMotion::kStart> carried =
        by_start * all.topLeftCorner<CarriedMotion::kStart, CarriedMotion::kStart>();
    const TeamPlace::Covariance noise = turn.lazyProduct(end_.noise + problem_->self_end.noise);
    place.covariance = carried.lazyProduct(by_start.transpose());
    place.covariance += noise.lazyProduct(turn.transpose());
    return place;
  }

 private:
  [[nodiscard]] ImuErrors imu_errors() const {
    return errors_.segment<CarriedMotion::kErrors>(CarriedMotion::kMotion);
  }

  /// False if there is no solution.
  [[nodiscard]] bool linearize() {
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

  void add(const FittedRange& z) {
    constexpr int kStart = CarriedMotion::kStart;
    const ImuErrors errors = imu_errors();
    const Eigen::Quaterniond q = z.q * so3_exp(z.theta_by_errors * errors);
    const Eigen::Vector3d antenna = z.p + z.p_by_errors * errors + q * problem_->p_body_uwb;
    const Eigen::Vector3d d =
        start_.p_F + z.t_s * start_.v_F + start_.q_F_B * antenna - z.p_F_beacon;
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

  void apply(const Eigen::VectorXd& step) {
    start_.p_F += step.head<3>();
    start_.v_F += step.segment<3>(3);
    start_.q_F_B = (start_.q_F_B * so3_exp(step.segment<3>(6))).normalized();
    errors_ += step;
    errors_.head<CarriedMotion::kMotion>().setZero();
  }

  const RangeProblem* problem_;
  FreeMotion start_;
  Eigen::VectorXd errors_;  ///< of IMU and beacons; zero for the motion
  Eigen::MatrixXd information_;
  Eigen::LDLT<Eigen::MatrixXd> factors_;
  Eigen::VectorXd gradient_;
  double cost_ = std::numeric_limits<double>::infinity();
  std::size_t outliers_ = 0;
  bool is_converged_ = false;
  CarriedMotion end_;
};

bool is_certain(const TeamPlace& place) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> attitude(
      place.covariance.bottomRightCorner<3, 3>());
  return place.covariance.topLeftCorner<3, 3>().trace() <= kMostPosition * kMostPosition &&
         attitude.eigenvalues()(0) > 0.0 &&
         attitude.eigenvalues()(2) <= kMostAttitude * kMostAttitude;
}

/// False if the other place is not near this one.
bool contain(const TeamPlace& other, TeamPlace& place) {
  const Vector6d d = pose_difference(other.T_S_N, place.T_S_N);
  if (d.head<3>().norm() > kNear || d.tail<3>().norm() > kNearAttitude) return false;
  Eigen::Matrix<double, FreeMotionAt::kMotion, 1> step;
  step << d.head<3>(), other.v_S_N - place.v_S_N, d.tail<3>();
  place.covariance += step * step.transpose();
  return true;
}

}  // namespace

std::optional<TeamPlace> place_by_ranges(const std::deque<UnseenInterval>& intervals,
                                         const RangePlaceSettings& settings) {
  const RangeProblem problem(intervals, settings);
  if (problem.spheres.size() < kLeastTrack) return std::nullopt;
  std::vector<RangeFit> fits;
  for (const double side : {1.0, -1.0})
    fits.emplace_back(problem, range_track(problem.spheres, side), std::nullopt);
  const RangeFit first = *std::ranges::min_element(fits, {}, &RangeFit::cost);
  if (!first.is_consistent() || !is_certain(first.place())) return std::nullopt;
  // Both may have ended on the same side of the beacons, or with the same wrong heading.
  fits.emplace_back(problem, mirrored(first.track(), problem.spheres), std::nullopt);
  for (const double quarter : {1.0, 2.0, 3.0})
    fits.emplace_back(problem, first.track(), first.turned(0.5 * std::numbers::pi * quarter));
  const RangeFit& best = *std::ranges::min_element(fits, {}, &RangeFit::cost);
  if (!best.is_consistent()) return std::nullopt;
  TeamPlace place = best.place();
  for (const RangeFit& fit : fits) {
    if (&fit != &best && fit.cost() <= best.cost() + kClearChi2 && !contain(fit.place(), place))
      return std::nullopt;
  }
  return is_certain(place) ? std::optional(place) : std::nullopt;
}

}  // namespace crepes
