#include "estimator/team/unseen/range_problem.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "estimator/team/belief/team_belief.hpp"

namespace crepes {
namespace {

constexpr std::size_t kLeastSpheres = 4;
// What hides a robot from all cameras may lengthen its ranges, for as long as it does.
constexpr double kHiddenSigma = 0.15;  // m; of a beacon's ranges together

/// Of errors, which are expected to be zero; none of the motion.
Eigen::VectorXd prior_information(const std::map<RobotId, double>& beacons,
                                  const RangeProblemSettings& settings) {
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

}  // namespace

FittedRange::FittedRange(const RangeReading& range, Eigen::Vector3d beacon, int index,
                         const CarriedMotion& path)
    : reading(range),
      p_F_beacon(std::move(beacon)),
      error(index),
      t_s(path.t_s),
      p(path.motion.p_F),
      q(path.motion.q_F_B),
      p_by_errors(path.by_errors.topRows<3>()),
      theta_by_errors(path.by_errors.bottomRows<3>()),
      p_noise(path.noise.topLeftCorner<3, 3>()) {}

RangeProblem::RangeProblem(const std::deque<UnseenInterval>& intervals,
                           const RangeProblemSettings& settings)
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

void RangeProblem::add(const UnseenInterval& interval, const std::map<RobotId, double>& beacons,
                       const RangeProblemSettings& settings) {
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
  const RobotTrajectory self_piece(self, settings.self_bias, interval.self_imu, interval.duration_s,
                                   settings.noise);
  self_end = self_end.followed_by(self_piece.end());
}

}  // namespace crepes
