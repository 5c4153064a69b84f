/// A robot's place and attitude by its ranges and its IMU.
#include "estimator/team/unseen/range_place.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <deque>
#include <vector>

#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"
#include "estimator/team/unseen/range_track.hpp"
#include "tests/support/random_geometry.hpp"
#include "tests/support/simulated_team.hpp"

namespace crepes::range_place_test {
namespace {

constexpr double kDuration = 0.1;  // s, of an interval
const Eigen::Vector3d kUp(0.0, 0.0, kGravityMps2);

/// Errors of the robot's sensors.
struct Errors {
  ImuBias imu{};
  std::vector<double> ranges_m = std::vector<double>(5, 0.0);  ///< of each beacon
};

/// Self hovers level, and five beacons with it. The robot moves about, for 4 s.
struct Scene {
  std::deque<UnseenInterval> intervals;
  RangeProblemSettings settings;
  Pose T_S_N;
  Eigen::Vector3d v_S_N = Eigen::Vector3d::Zero();

  Scene(std::uint64_t seed, const Errors& errors) {
    test::RandomGeometry random(seed);
    settings.p_body_uwb = {0.05, 0.0, 0.12};
    settings.noise = test::team_settings().noise;
    settings.priors = test::team_settings().priors;
    std::vector<Eigen::Vector3d> beacons;
    for (std::size_t i = 0; i < errors.ranges_m.size(); ++i) beacons.push_back(random.vector(3.0));
    FreeMotion robot{{5.0, 1.0, 2.0}, random.vector(0.5), random.rotation()};
    FreeMotion self;
    double phase = random.uniform(0.0, 6.0);
    for (int i = 0; i < 40; ++i) {
      UnseenInterval interval;
      interval.duration_s = kDuration;
      interval.self_imu.resize(10);
      for (ImuMean& mean : interval.self_imu) mean.accel_mps2 = kUp;
      interval.imu.resize(10);
      Eigen::Quaterniond q = robot.q_F_B;
      for (ImuMean& mean : interval.imu) {
        phase += 0.01;
        mean.gyro_radps = 0.5 * Eigen::Vector3d(std::sin(2.0 * phase), std::cos(phase), 0.5);
        mean.accel_mps2 = q.conjugate() * (kUp + Eigen::Vector3d(std::cos(3.0 * phase),
                                                                 std::sin(2.0 * phase), 0.5));
        q = q * so3_exp(0.01 * mean.gyro_radps);
      }
      const RobotTrajectory path(robot, {}, interval.imu, kDuration, {});
      const RobotTrajectory own(self, {}, interval.self_imu, kDuration, {});
      constexpr double kTime = 0.05;
      const FreeMotion at = path.motion_at(kTime);
      for (std::size_t k = 0; k < beacons.size(); ++k) {
        const Eigen::Vector3d antenna = at.p_F + at.q_F_B * settings.p_body_uwb;
        const double distance = (antenna - own.motion_at(kTime).p_F - beacons[k]).norm();
        interval.ranges.push_back({.beacon = RobotId{static_cast<std::uint16_t>(k + 2)},
                                   .t_s = kTime,
                                   .reading = {distance + errors.ranges_m[k], test::kRangeSigma},
                                   .p_F_beacon = beacons[k] + 0.5 * kTime * kTime * kUp,
                                   .beacon_variance_m2 = 0.0});
      }
      for (ImuMean& mean : interval.imu) {
        mean.gyro_radps += errors.imu.gyro_radps;
        mean.accel_mps2 += errors.imu.accel_mps2;
      }
      robot = path.end().motion;
      self = own.end().motion;
      intervals.push_back(interval);
    }
    T_S_N = {robot.p_F - self.p_F, robot.q_F_B};
    v_S_N = robot.v_F - self.v_F;
  }
};

TEST(RangePlace, IsExactWithoutErrors) {
  int places = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Scene scene(seed, {});
    const auto place = place_by_ranges(scene.intervals, scene.settings);
    if (!place) continue;  // geometry leaves a mirror image
    ++places;
    EXPECT_LT(pose_difference(place->T_S_N, scene.T_S_N).norm(), 2e-3) << seed;
    EXPECT_LT((place->v_S_N - scene.v_S_N).norm(), 2e-3) << seed;
  }
  EXPECT_GE(places, 5);
}

// If a derivative were wrong, errors of the IMU would not be found, or their effect underestimated.
TEST(RangePlace, CoversTheErrorsOfItsSensors) {
  int places = 0;
  double sum = 0.0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    test::RandomGeometry random(seed + 1000);
    Errors errors;
    errors.imu = {.gyro_radps = random.vector(0.005), .accel_mps2 = random.vector(0.035)};
    for (double& error_m : errors.ranges_m) error_m = random.normal(0.15);
    const Scene scene(seed, errors);
    const auto place = place_by_ranges(scene.intervals, scene.settings);
    if (!place) continue;
    ++places;
    Eigen::Matrix<double, 9, 1> e;
    const Vector6d d = pose_difference(place->T_S_N, scene.T_S_N);
    e << d.head<3>(), scene.v_S_N - place->v_S_N, d.tail<3>();
    const double nees = e.dot(place->covariance.llt().solve(e));
    EXPECT_LT(nees, 55.0) << seed;  // five sigma, of nine degrees of freedom
    sum += nees;
  }
  ASSERT_GE(places, 20);
  // Less than nine: the ranges have no noise here, which the covariance allows for.
  EXPECT_GT(sum / places, 1.5);
  EXPECT_LT(sum / places, 6.0);
}

TEST(RangeTrack, IsOnTheSideOnWhichItBegins) {
  std::vector<RangeSpheres> all;
  RangeTrack truth;
  for (int i = 0; i < 20; ++i) {
    const double t = 0.1 * i;
    const Eigen::Vector3d p(2.0 + t, std::sin(t), 3.0 + t * t);
    truth.push_back({t, p});
    all.push_back({t, {}});
    for (const Eigen::Vector3d& center : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(4, 0, 0),
                                          Eigen::Vector3d(0, 4, 0), Eigen::Vector3d(4, 4, 0)})
      all.back().spheres.emplace_back(center, (p - center).norm());
  }
  const RangeTrack up = range_track(all, 1.0);
  const RangeTrack down = range_track(all, -1.0);
  const RangeTrack image = mirrored(up, all);
  const bool is_up = up[0].p.z() > 0.0;  // the normal's sign is arbitrary
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_LT(((is_up ? up : down)[i].p - truth[i].p).norm(), 1e-2) << i;
    EXPECT_LT((image[i].p - down[i].p).norm(), 1e-2) << i;
  }
}

TEST(RangeTrack, ShowsTheAttitudeOfAPath) {
  test::RandomGeometry random(1);
  const Eigen::Quaterniond q = random.rotation();
  RangeTrack path;
  RangeTrack track;
  for (int i = 0; i < 20; ++i) {
    const double t = 0.1 * i;
    path.push_back({t, {std::sin(t), t * t, std::cos(2.0 * t)}});
    track.push_back({t, Eigen::Vector3d(1.0, 2.0, 3.0) + t * Eigen::Vector3d(0.3, -0.2, 0.1) +
                            q * path.back().p});
  }
  EXPECT_LT(attitude_along(track, path).angularDistance(q), 1e-6);
  const FreeMotion motion = motion_along(track, path, q);
  EXPECT_LT((motion.p_F - Eigen::Vector3d(1.0, 2.0, 3.0)).norm(), 1e-9);
  EXPECT_LT((motion.v_F - Eigen::Vector3d(0.3, -0.2, 0.1)).norm(), 1e-9);
}

}  // namespace
}  // namespace crepes::range_place_test
