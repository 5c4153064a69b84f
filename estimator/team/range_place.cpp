#include "estimator/team/range_place.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
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
constexpr double kMostError = 3.0;              // sigmas; of a beacon's or the IMU's errors
constexpr double kMostChi2 = 1.5;               // a range
constexpr double kMostPosition = 0.7;           // m; sigma of its place
constexpr double kMostAttitude = radians(8.0);  // rad; sigma about any axis
constexpr double kClearChi2 = 25.0;             // by which another place is less likely
constexpr double kNear = 1.0;                   // m
constexpr double kNearAttitude = radians(15.0);
constexpr double kLeastForce = 0.5 * kGravityMps2;  // mean specific force that shows what is up
constexpr double kUpright = 0.5;                    // cosine between what is up for two robots
constexpr int kFitIterations = 20;
constexpr double kFitted = 1e-4;  // rad, m, m/s
constexpr double kTooNear = 0.1;  // m; antennas are not nearer
constexpr double kTwoImus = 2.0;  // of the same noise

/// A motion with its derivative by the motion at the first beginning and by the IMU's errors.
struct ChainedMotion {
  static constexpr int kMotion = FreeMotionAt::kMotion;
  static constexpr int kStart = FreeMotionAt::kStart;

  FreeMotion motion{};
  Eigen::Matrix<double, kMotion, kStart> by_start =
      Eigen::Matrix<double, kMotion, kStart>::Identity();
  TeamPlace::Covariance noise = TeamPlace::Covariance::Zero();

  /// At a point of a trajectory that begins here.
  [[nodiscard]] ChainedMotion followed_by(const FreeMotionAt& piece) const {
    ChainedMotion next{.motion = piece.motion};
    const TeamPlace::Covariance by_motion = piece.by_start.leftCols<kMotion>();
    next.by_start = by_motion.lazyProduct(by_start);
    next.by_start.rightCols<FreeMotionAt::kBias>() +=
        piece.by_start.rightCols<FreeMotionAt::kBias>();
    const TeamPlace::Covariance carried = by_motion.lazyProduct(noise);
    next.noise = carried.lazyProduct(by_motion.transpose());
    next.noise += piece.noise;
    return next;
  }
};

/// Self at the beginning of each interval and at the end, in the frame of the first one.
struct SelfPath {
  std::vector<double> t_s{0.0};
  std::vector<FreeMotion> motions{FreeMotion{}};
  TeamPlace::Covariance noise = TeamPlace::Covariance::Zero();  ///< of the end

  SelfPath(const std::deque<UnseenInterval>& intervals, const RangePlaceSettings& settings) {
    ChainedMotion at;
    for (const UnseenInterval& interval : intervals) {
      const RobotTrajectory piece(at.motion, settings.self_bias, interval.self_imu,
                                  interval.duration_s, settings.noise);
      at = at.followed_by(piece.end());
      t_s.push_back(t_s.back() + interval.duration_s);
      motions.push_back(at.motion);
    }
    noise = at.noise;
  }

  /// The beacon's antenna in the frame of the first interval.
  [[nodiscard]] Eigen::Vector3d beacon(std::size_t interval, const BeaconRange& z) const {
    const FreeMotion& self = motions[interval];
    return self.p_F + z.t_s * self.v_F + self.q_F_B * z.p_F_beacon;
  }
};

/// The latest range to each beacon; intervals with fewer than four are left out.
std::vector<RangeSpheres> spheres_of(const std::deque<UnseenInterval>& intervals,
                                     const SelfPath& self) {
  std::vector<RangeSpheres> all;
  for (std::size_t i = 0; i < intervals.size(); ++i) {
    std::map<RobotId, std::pair<Eigen::Vector3d, double>> latest;
    RangeSpheres spheres{.interval = i, .t_s = self.t_s[i], .spheres = {}};
    for (const BeaconRange& z : intervals[i].ranges) {
      latest[z.beacon] = {self.beacon(i, z), z.reading.range_m};
      spheres.t_s += z.t_s / static_cast<double>(intervals[i].ranges.size());
    }
    if (latest.size() < kLeastSpheres) continue;
    for (const auto& [beacon, sphere] : latest) spheres.spheres.push_back(sphere);
    all.push_back(std::move(spheres));
  }
  return all;
}

/// Least squares over all ranges of the intervals. Refers to its arguments.
class RangeFit {
 public:
  RangeFit(const std::deque<UnseenInterval>& intervals, const SelfPath& self,
           const RangePlaceSettings& settings)
      : intervals_(intervals), self_(self), settings_(settings) {
    std::map<RobotId, double> variances;
    for (const UnseenInterval& interval : intervals) {
      for (const BeaconRange& z : interval.ranges) {
        double& variance = variances[z.beacon];
        variance = std::max(variance, z.beacon_variance_m2);
        ++count_;
      }
    }
    int index = ChainedMotion::kStart;
    for (const auto& [beacon, variance] : variances) index_of_[beacon] = index++;
    prior_ = prior_information(variances);
  }

  /// From the motion that carries the IMU's path onto a track, in the attitude that the track shows
  /// or in a given one.
  void improve(const RangeTrack& track, const std::optional<Eigen::Quaterniond>& attitude) {
    const RangeTrack by_imu = along(track, {}, {});
    start_ = motion_along(track, by_imu, attitude ? *attitude : attitude_along(track, by_imu));
    errors_ = Eigen::VectorXd::Zero(prior_.size());
    is_converged_ = false;
    for (int i = 0; linearize() && !is_converged_ && i < kFitIterations; ++i) {
      const Eigen::VectorXd step = factors_.solve(gradient_);
      is_converged_ = step.head<ChainedMotion::kMotion>().norm() < kFitted;
      apply(step);
    }
  }

  /// What was found, at the times of a track.
  [[nodiscard]] RangeTrack track(const RangeTrack& times) const {
    return along(times, start_, bias());
  }
  /// The attitude at the first beginning, turned about what is up.
  [[nodiscard]] Eigen::Quaterniond turned(double angle) const {
    const Eigen::Vector3d up = (end_.motion.v_F - start_.v_F).normalized();
    return (so3_exp(angle * up) * start_.q_F_B).normalized();
  }
  /// Infinite if there is no solution.
  [[nodiscard]] double cost() const { return cost_; }
  [[nodiscard]] bool is_consistent() const {
    const auto n = static_cast<double>(count_);
    const double largest_error = errors_.cwiseAbs2().cwiseProduct(prior_).maxCoeff();
    return is_converged_ && largest_error <= kMostError * kMostError && cost_ <= kMostChi2 * n &&
           static_cast<double>(outliers_) <= kMostOutliers * n;
  }
  /// No robot flies upside down: what is up for self is so for the robot.
  [[nodiscard]] bool is_upright() const {
    const Eigen::Vector3d own = self_.motions.back().v_F / self_.t_s.back();
    const Eigen::Vector3d other = (end_.motion.v_F - start_.v_F) / self_.t_s.back();
    return std::min(own.norm(), other.norm()) < kLeastForce ||
           own.dot(other) >= kUpright * own.norm() * other.norm();
  }
  /// At the end, in the frame that then falls freely with self, with the noise of both IMUs.
  [[nodiscard]] TeamPlace place() const {
    const FreeMotion& here = self_.motions.back();
    const FreeMotion& there = end_.motion;
    const Eigen::Quaterniond q_B_F = here.q_F_B.conjugate();
    TeamPlace place{.T_S_N = {q_B_F * (there.p_F - here.p_F), (q_B_F * there.q_F_B).normalized()},
                    .v_S_N = q_B_F * (there.v_F - here.v_F)};
    const Eigen::MatrixXd all =
        factors_.solve(Eigen::MatrixXd::Identity(prior_.size(), prior_.size()));
    TeamPlace::Covariance turn = TeamPlace::Covariance::Identity();
    turn.block<3, 3>(0, 0) = q_B_F.toRotationMatrix();
    turn.block<3, 3>(3, 3) = q_B_F.toRotationMatrix();
    const Eigen::Matrix<double, ChainedMotion::kMotion, ChainedMotion::kStart> by_start =
        turn.lazyProduct(end_.by_start);
    const Eigen::Matrix<double, ChainedMotion::kMotion, ChainedMotion::kStart> carried =
        by_start * all.topLeftCorner<ChainedMotion::kStart, ChainedMotion::kStart>();
    const TeamPlace::Covariance noise = turn.lazyProduct(end_.noise + self_.noise);
    place.covariance = carried.lazyProduct(by_start.transpose());
    place.covariance += noise.lazyProduct(turn.transpose());
    return place;
  }

 private:
  /// Of the errors, which are expected to be zero; none of the motion.
  [[nodiscard]] Eigen::VectorXd prior_information(const std::map<RobotId, double>& variances) {
    constexpr int kBias = ChainedMotion::kMotion;
    const Priors& priors = settings_.priors;
    Eigen::VectorXd variance = Eigen::VectorXd::Ones(ChainedMotion::kStart + std::ssize(variances));
    variance.segment<3>(kBias).setConstant(priors.gyro_bias_radps * priors.gyro_bias_radps +
                                           settings_.self_gyro_variance);
    variance.segment<3>(kBias + 3).setConstant(accel_bias_variance(priors) +
                                               settings_.self_accel_variance);
    variance.segment<9>(kBias + 6).setConstant(priors.gyro_scale * priors.gyro_scale);
    for (const auto& [beacon, of_beacon] : variances) {
      variance(index_of_.at(beacon)) =
          kHiddenSigma * kHiddenSigma + priors.range_bias_m * priors.range_bias_m + of_beacon;
    }
    Eigen::VectorXd information = variance.cwiseMax(TeamBelief::kLeastVariance).cwiseInverse();
    information.head<ChainedMotion::kMotion>().setZero();
    return information;
  }

  [[nodiscard]] RobotTrajectory path(std::size_t interval, const FreeMotion& start,
                                     const ImuBias& bias) const {
    return {start, bias, intervals_[interval].imu, intervals_[interval].duration_s,
            settings_.noise};
  }

  /// The antenna's way from a start on.
  [[nodiscard]] RangeTrack along(RangeTrack track, FreeMotion motion, const ImuBias& bias) const {
    auto point = track.begin();
    for (std::size_t i = 0; i < intervals_.size(); ++i) {
      const RobotTrajectory piece = path(i, motion, bias);
      if (point != track.end() && point->interval == i) {
        const FreeMotion at = piece.motion_at(point->t_s - self_.t_s[i]);
        point->p = at.p_F + at.q_F_B * settings_.p_body_uwb;
        ++point;
      }
      motion = piece.end().motion;
    }
    return track;
  }

  /// False if there is no solution.
  [[nodiscard]] bool linearize() {
    information_ = prior_.asDiagonal();
    gradient_ = -prior_.cwiseProduct(errors_);
    cost_ = errors_.dot(prior_.cwiseProduct(errors_));
    outliers_ = 0;
    end_ = {.motion = start_};
    for (std::size_t i = 0; i < intervals_.size(); ++i) {
      const RobotTrajectory piece = path(i, end_.motion, bias());
      for (const BeaconRange& z : intervals_[i].ranges)
        add(z, self_.beacon(i, z), end_.followed_by(piece.at(z.t_s)));
      end_ = end_.followed_by(piece.end());
    }
    factors_.compute(information_);
    const bool is_solved = factors_.info() == Eigen::Success && std::isfinite(cost_);
    if (!is_solved) cost_ = std::numeric_limits<double>::infinity();
    return is_solved;
  }

  void add(const BeaconRange& z, const Eigen::Vector3d& p_F_beacon, const ChainedMotion& at) {
    const Eigen::Matrix3d R = at.motion.R();
    const Eigen::Vector3d d = at.motion.p_F + R * settings_.p_body_uwb - p_F_beacon;
    const double distance = std::max(d.norm(), kTooNear);
    const Eigen::Vector3d u = d / distance;
    const Eigen::RowVector3d by_theta = -u.transpose() * R * hat(settings_.p_body_uwb);
    const int index = index_of_.at(z.beacon);
    Eigen::VectorXd row = Eigen::VectorXd::Zero(prior_.size());
    row.head<ChainedMotion::kStart>() =
        (u.transpose() * at.by_start.topRows<3>() + by_theta * at.by_start.bottomRows<3>())
            .transpose();
    row(index) = 1.0;
    const double residual = z.reading.range_m - distance - errors_(index);
    const double variance = z.reading.sigma_m * z.reading.sigma_m +
                            kTwoImus * u.dot(at.noise.topLeftCorner<3, 3>() * u);
    const double sigmas = std::abs(residual) / std::sqrt(variance);
    const bool is_outlier = sigmas > kHuber;
    outliers_ += is_outlier ? 1 : 0;
    cost_ += is_outlier ? kHuber * (2.0 * sigmas - kHuber) : sigmas * sigmas;
    const double weight = (is_outlier ? kHuber / sigmas : 1.0) / variance;
    information_ += weight * row * row.transpose();
    gradient_ += weight * residual * row;
  }

  void apply(const Eigen::VectorXd& step) {
    start_.p_F += step.head<3>();
    start_.v_F += step.segment<3>(3);
    start_.q_F_B = (start_.q_F_B * so3_exp(step.segment<3>(6))).normalized();
    errors_ += step;
    errors_.head<ChainedMotion::kMotion>().setZero();
  }

  [[nodiscard]] ImuBias bias() const {
    constexpr int kBias = ChainedMotion::kMotion;
    return {.gyro_radps = errors_.segment<3>(kBias),
            .accel_mps2 = errors_.segment<3>(kBias + 3),
            .gyro_scale = errors_.segment<9>(kBias + 6).reshaped<Eigen::ColMajor>(3, 3)};
  }

  const std::deque<UnseenInterval>& intervals_;
  const SelfPath& self_;
  const RangePlaceSettings& settings_;
  std::map<RobotId, int> index_of_;  ///< of a beacon's error
  std::size_t count_ = 0;            ///< ranges
  Eigen::VectorXd prior_;            ///< information

  FreeMotion start_;
  Eigen::VectorXd errors_;  ///< of IMU and beacons; zero for the motion
  Eigen::MatrixXd information_;
  Eigen::LDLT<Eigen::MatrixXd> factors_;
  Eigen::VectorXd gradient_;
  double cost_ = std::numeric_limits<double>::infinity();
  std::size_t outliers_ = 0;
  bool is_converged_ = false;
  ChainedMotion end_;
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
  const SelfPath self(intervals, settings);
  const std::vector<RangeSpheres> spheres = spheres_of(intervals, self);
  if (spheres.size() < kLeastTrack) return std::nullopt;
  const auto cost_of = [](const RangeFit& fit) {
    return fit.is_upright() ? fit.cost() : std::numeric_limits<double>::infinity();
  };
  std::vector<RangeFit> fits;
  const auto add = [&](const RangeTrack& track, const std::optional<Eigen::Quaterniond>& attitude) {
    fits.emplace_back(intervals, self, settings).improve(track, attitude);
  };
  for (const double side : {1.0, -1.0}) add(range_track(spheres, side), {});
  const RangeFit first = *std::ranges::min_element(fits, {}, cost_of);
  if (!first.is_consistent() || !is_certain(first.place())) return std::nullopt;
  const RangeTrack track = first.track(range_track(spheres, 1.0));
  // Both may have ended on the same side of the beacons, or with the same wrong heading.
  add(mirrored(track, spheres), {});
  for (const double quarter : {1.0, 2.0, 3.0})
    add(track, first.turned(0.5 * std::numbers::pi * quarter));
  const RangeFit& best = *std::ranges::min_element(fits, {}, cost_of);
  if (!best.is_consistent() || !best.is_upright()) return std::nullopt;
  TeamPlace place = best.place();
  for (const RangeFit& fit : fits) {
    if (&fit != &best && cost_of(fit) <= best.cost() + kClearChi2 && !contain(fit.place(), place))
      return std::nullopt;
  }
  return is_certain(place) ? std::optional(place) : std::nullopt;
}

}  // namespace crepes
