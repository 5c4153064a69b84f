// Whether the tight filter's errors are as large as it says.
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "tests/support/tight_filter.hpp"

namespace crepes::neighbor_filter_honesty_test {
namespace {

using namespace std::chrono_literals;
using test::first_raw_pose;
using test::kNoGate;
using test::pose_error;
using test::run;
using test::SimulatedPair;
using test::tight_filter;

/// A first pose whose error is what its covariance says and has nothing to do with any sensor's.
RawPose independent_start(SimulatedPair& pair, std::uint64_t seed) {
  test::RandomGeometry random(seed + 1000);
  RawPose start = first_raw_pose(pair, Timestamp{50ms});
  const Pose truth = pair.truth(Timestamp{50ms}).motion.T_B_N;
  start.T_B_N = perturbed(truth, random.draw<6>(start.gaussian().covariance));
  start.by_calibration = {};
  return start;
}

/// Mean normalized squared error of the pose over 50 pairs' filters, divided by its dimension.
template <class MakeFilter>
double mean_pose_nees(const MakeFilter& make_filter) {
  constexpr int kRuns = 50;
  double sum = 0.0;
  for (std::uint64_t seed = 100; seed < 100 + kRuns; ++seed) {
    SimulatedPair pair(seed);
    const NeighborFilter filter = make_filter(pair, seed);
    const Vector6d e = pose_error(pair, filter);
    sum += e.dot(filter.pose_covariance().inverse() * e);
  }
  return sum / (6 * kRuns);
}

/// After so long from `start`.
template <class Start>
double mean_pose_nees(Duration duration, const Start& start) {
  return mean_pose_nees([&](SimulatedPair& pair, std::uint64_t seed) {
    return tight_filter(pair, start(pair, seed), duration);
  });
}

// chi-square with 300 degrees of freedom lies within [253.9, 349.9] in 95 % of all trials.
constexpr double kLow = 253.9 / 300;
constexpr double kHigh = 349.9 / 300;

TEST(NeighborFilter, ErrorsAreAsLargeAsItSaysAfterASecond) {
  const double nees = mean_pose_nees(1s, independent_start);
  EXPECT_GT(nees, kLow);
  EXPECT_LT(nees, kHigh);
}

TEST(NeighborFilter, ErrorsAreAsLargeAsItSaysAfterFiveSeconds) {
  const double nees = mean_pose_nees(5s, independent_start);
  EXPECT_GT(nees, kLow);
  EXPECT_LT(nees, kHigh);
}

/// Without ranges after the first pose, three seconds with sharp bearings at the rates of a robot:
/// the mean normalized squared error of the pose over its dimension, and the share of distances
/// that are off by more than three sigma.
struct WithoutRanges {
  double nees = 0.0;
  double beyond = 0.0;
};
WithoutRanges without_ranges() {
  constexpr int kRuns = 200;
  test::PairNoise noise;
  noise.bearing = 6e-4;
  noise.priors.range_bias_m = 0.2;
  WithoutRanges found;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    SimulatedPair pair(seed, noise);
    NeighborFilter filter = tight_filter(pair, 0s);
    for (int frame = 1; frame <= 600; ++frame) {
      const Timestamp t = filter.stamp() + 5ms;
      pair.sample_imus(t + 10ms);
      filter.advance_to(t, pair.imu_B, pair.imu_N);
      static_cast<void>(filter.fuse_bearing(pair.bearing(t), pair.mounting_N.led, kNoGate));
      if (frame % 4 == 0)
        static_cast<void>(
            filter.fuse_peer_bearing(pair.peer_bearing(t), pair.mounting_B.led, kNoGate));
    }
    const Vector6d e = pose_error(pair, filter);
    const Matrix6d P = filter.pose_covariance();
    const Eigen::Vector3d u = filter.motion().T_B_N.p.normalized();
    found.nees += e.dot(P.inverse() * e) / (6 * kRuns);
    const double sigma = std::sqrt(u.dot(P.topLeftCorner<3, 3>() * u));
    found.beyond += std::abs(u.dot(e.head<3>())) > 3.0 * sigma ? 1.0 / kRuns : 0.0;
  }
  return found;
}

TEST(NeighborFilter, WithoutRangesItsDistanceIsAsUncertainAsItSays) {
  const auto [nees, beyond] = without_ranges();
  EXPECT_GT(nees, 0.8);
  EXPECT_LT(nees, 1.25);
  EXPECT_LE(beyond, 0.04);  // 0.003 of a Gaussian; 0.27 of a filter in Cartesian coordinates
}

TEST(NeighborFilter, ErrorsAreAsLargeAsItSaysOnceOtherCamerasLook) {
  const double nees = mean_pose_nees([](SimulatedPair& pair, std::uint64_t) {
    NeighborFilter filter = tight_filter(pair, 3s);
    pair.change_cameras();
    for (const MeasurementKind kind : {MeasurementKind::kBearing, MeasurementKind::kPeerBearing})
      filter.reset_misalignment(kind, pair.priors().misalignment_rad);
    run(filter, pair, 2s);
    return filter;
  });
  EXPECT_GT(nees, kLow);
  EXPECT_LT(nees, kHigh);
}

// A raw pose shares the range's bias, the cameras' misalignments and the accelerometers' biases
// with the filter's own states.
TEST(NeighborFilter, ErrorsAreAsLargeAsItSaysFiveSecondsAfterARawPose) {
  const double nees = mean_pose_nees(
      5s, [](SimulatedPair& pair, std::uint64_t) { return first_raw_pose(pair, Timestamp{50ms}); });
  EXPECT_GT(nees, kLow);
  EXPECT_LT(nees, kHigh);
}

TEST(NeighborFilter, ErrorsAreAsLargeAsItSaysRightAfterARawPose) {
  const double nees = mean_pose_nees(
      0s, [](SimulatedPair& pair, std::uint64_t) { return first_raw_pose(pair, Timestamp{50ms}); });
  EXPECT_GT(nees, kLow);
  EXPECT_LT(nees, kHigh);
}

/// The filter after two robots stood still, at `p_B_N` in truth. The range's bias is zero.
NeighborFilter after_rest(std::uint64_t seed, Duration duration, const Eigen::Vector3d& p_B_N,
                          double bias_sigma_m) {
  constexpr double kBearing = 3.5e-4;  // rad
  constexpr double kRange = 0.05;      // m
  test::RandomGeometry random(seed);
  const ProcessNoise noise{.gyro_density = 4e-4, .accel_density = 2e-3};
  ImuHistory imu_B;
  ImuHistory imu_N;
  const auto sample = [&](Timestamp t) {
    for (ImuHistory* imu : {&imu_B, &imu_N}) {
      imu->push(
          {t, random.normal_vector<3>(10.0 * noise.gyro_density),
           Eigen::Vector3d(0, 0, 9.81) + random.normal_vector<3>(10.0 * noise.accel_density)});
    }
  };
  const auto seen = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector3d u = p.normalized();
    return DirectionReading{(u + tangent_basis(u) * random.normal_vector<2>(kBearing)).normalized(),
                            Eigen::Vector3d::Zero(), kBearing};
  };

  sample(Timestamp{0ms});
  Matrix6d start = Matrix6d::Identity() * 1e-4;
  start.topLeftCorner<3, 3>().diagonal().setConstant(0.01);
  NeighborFilter filter(Timestamp{0ms},
                        GaussianPose{{p_B_N, Eigen::Quaterniond::Identity()}, start}, noise,
                        {.speed_mps = 0.1,
                         .gyro_bias_radps = 0.005,
                         .accel_bias_mps2 = 0.03,
                         .range_bias_m = bias_sigma_m,
                         .misalignment_rad = 0.0026});
  for (Timestamp t{10ms}; t <= Timestamp{duration}; t += 10ms) {
    sample(t);
    filter.advance_to(t, imu_B, imu_N);
    static_cast<void>(filter.fuse_bearing(seen(p_B_N), Eigen::Vector3d::Zero(), kNoGate));
    static_cast<void>(filter.fuse_peer_bearing(seen(-p_B_N), Eigen::Vector3d::Zero(), kNoGate));
    static_cast<void>(filter.fuse_range({p_B_N.norm() + random.normal(kRange), kRange},
                                        Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), kNoGate));
  }
  return filter;
}

TEST(NeighborFilter, AtRestBearingsSayNothingOfTheDistance) {
  constexpr int kRuns = 10;
  const Eigen::Vector3d p_B_N(4.0, 1.0, 0.3);
  double sum = 0.0;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed)
    sum += after_rest(seed, 60s, p_B_N, 0.05).state().range_bias_m;

  EXPECT_NEAR(sum / kRuns, 0.0, 0.02);
}

// The first range said so, and nothing can tell it from the range's bias.
TEST(NeighborFilter, AtRestADistanceStaysAsUncertainAsTheRangesBias) {
  constexpr int kRuns = 20;
  constexpr double kBias = 0.1;  // m
  const Eigen::Vector3d p_B_N(1.0, 0.3, 0.1);
  const Eigen::Vector3d u = p_B_N.normalized();
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    const NeighborFilter filter = after_rest(seed, 20s, p_B_N, kBias);
    const Eigen::Matrix3d P = filter.pose_covariance().topLeftCorner<3, 3>();
    // The start knows it with a sigma of 0.1 m, too; of both remains 0.07 m.
    EXPECT_GT(std::sqrt(u.dot(P * u)), 0.9 * kBias / std::sqrt(2.0)) << seed;
  }
}

/// Of where across the line of sight the neighbor is, the mean squared error of 150 pairs over its
/// variance, after two seconds with 200 sharp bearings a second.
double across_ratio() {
  constexpr int kRuns = 150;
  test::PairNoise noise;
  noise.bearing = 0.001;
  double sum = 0.0;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    SimulatedPair pair(seed, noise);
    NeighborFilter filter = tight_filter(pair, 0s);
    while (filter.stamp() < Timestamp{2050ms}) {
      run(filter, pair, 10ms);
      for (int i = 0; i < 2; ++i)
        static_cast<void>(
            filter.fuse_bearing(pair.bearing(filter.stamp()), pair.mounting_N.led, kNoGate));
    }
    const Eigen::Matrix<double, 3, 2> across = tangent_basis(filter.motion().T_B_N.p.normalized());
    const Eigen::Vector2d error = across.transpose() * pose_error(pair, filter).head<3>();
    const Eigen::Matrix2d P =
        across.transpose() * filter.pose_covariance().topLeftCorner<3, 3>() * across;
    sum += error.dot(P.inverse() * error);
  }
  return sum / (2 * kRuns);
}

TEST(NeighborFilter, SharpBearingsDoNotTeachItTheCamerasMisalignment) {
  // chi-square with 300 degrees of freedom, as above
  const double ratio = across_ratio();
  EXPECT_GT(ratio, kLow);
  EXPECT_LT(ratio, kHigh);
}

}  // namespace
}  // namespace crepes::neighbor_filter_honesty_test
