#include "estimator/relative/neighbor_filter.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <limits>

#include "estimator/relative/paper_filter.hpp"
#include "tests/support/simulated_pair.hpp"

namespace crepes {
namespace {

using namespace std::chrono_literals;
using test::SimulatedPair;

constexpr double kNoGate = std::numeric_limits<double>::infinity();

RawPose first_raw_pose(SimulatedPair& pair, Timestamp t) {
  return std::get<RawPose>(compute_raw_pose(pair.sighting(t)));
}

/// Bearings of both at 50 Hz, ranges at 25 Hz.
void run(NeighborFilter& filter, SimulatedPair& pair, Duration duration) {
  for (const Timestamp end = filter.stamp() + duration; filter.stamp() < end;) {
    const Timestamp t = filter.stamp() + 10ms;
    pair.sample_imus(t);
    filter.advance_to(t, pair.imu_B, pair.imu_N);
    const auto tick = t.time_since_epoch() / 10ms;
    if (tick % 2 == 0) {
      static_cast<void>(filter.fuse_bearing(pair.bearing(t), pair.mounting_N.led, kNoGate));
      static_cast<void>(
          filter.fuse_peer_bearing(pair.peer_bearing(t), pair.mounting_B.led, kNoGate));
    }
    if (tick % 4 == 1) {
      static_cast<void>(filter.fuse_range(pair.range(t), pair.mounting_B.antenna,
                                          pair.mounting_N.antenna, kNoGate));
    }
  }
}

/// Runs the tight filter from `first` at 50 ms.
NeighborFilter tight_filter(SimulatedPair& pair, const RawPose& first, Duration duration) {
  pair.sample_imus(Timestamp{50ms});
  NeighborFilter filter(Timestamp{50ms}, first, pair.process_noise(), pair.priors());
  run(filter, pair, duration);
  return filter;
}

NeighborFilter tight_filter(SimulatedPair& pair, Duration duration) {
  return tight_filter(pair, first_raw_pose(pair, Timestamp{50ms}), duration);
}

template <class Filter>
Vector6d pose_error(const SimulatedPair& pair, const Filter& filter) {
  return pose_difference(filter.motion().T_B_N, pair.truth(filter.stamp()).motion.T_B_N);
}

TEST(NeighborFilter, ConvergesFromARawPose) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SimulatedPair pair(seed);

    const NeighborFilter filter = tight_filter(pair, 8s);

    const Vector6d error = pose_error(pair, filter);
    const NominalState truth = pair.truth(filter.stamp());
    EXPECT_LT(error.head<3>().norm(), 0.25) << seed;  // the range's bias of 0.1 m, one sigma
    EXPECT_LT(error.tail<3>().norm(), 0.03) << seed;
    EXPECT_LT((filter.motion().v_B_N - truth.motion.v_B_N).norm(), 0.15) << seed;
  }
}

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

TEST(NeighborFilter, ErrorsAreAsLargeAsItSaysOnceOtherCamerasLook) {
  const double nees = mean_pose_nees([](SimulatedPair& pair, std::uint64_t) {
    NeighborFilter filter = tight_filter(pair, 3s);
    pair.change_cameras();
    for (const MeasurementKind kind : {MeasurementKind::kBearing, MeasurementKind::kPeerBearing})
      filter.change_camera(kind, pair.priors().misalignment_rad);
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

TEST(NeighborFilter, EstimatesWhatTheSensorsHideBetterThanItsPriors) {
  double squared = 0.0;
  constexpr int kRuns = 20;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    SimulatedPair pair(seed);
    const NeighborFilter filter = tight_filter(pair, 10s);
    const NominalState truth = pair.truth(filter.stamp());
    squared += (filter.state().bias_N.gyro_radps - truth.bias_N.gyro_radps -
                (filter.state().motion.T_B_N.q.conjugate() *
                 (filter.state().bias_B.gyro_radps - truth.bias_B.gyro_radps)))
                   .squaredNorm();
  }

  // The difference of both gyros' biases, six priors' worth of variance at the start.
  EXPECT_LT(std::sqrt(squared / kRuns), 0.5 * std::sqrt(6.0) * 0.005);
}

/// What the filter takes the range's bias, zero in truth, for after two robots stood still.
double range_bias_learned_at_rest(std::uint64_t seed, Duration duration) {
  constexpr double kBearing = 3.5e-4;  // rad
  constexpr double kRange = 0.05;      // m
  test::RandomGeometry random(seed);
  const Eigen::Vector3d p_B_N(4.0, 1.0, 0.3);
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
                         .range_bias_m = 0.05,
                         .misalignment_rad = 0.0026});
  for (Timestamp t{10ms}; t <= Timestamp{duration}; t += 10ms) {
    sample(t);
    filter.advance_to(t, imu_B, imu_N);
    static_cast<void>(filter.fuse_bearing(seen(p_B_N), Eigen::Vector3d::Zero(), kNoGate));
    static_cast<void>(filter.fuse_peer_bearing(seen(-p_B_N), Eigen::Vector3d::Zero(), kNoGate));
    static_cast<void>(filter.fuse_range({p_B_N.norm() + random.normal(kRange), kRange},
                                        Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), kNoGate));
  }
  return filter.state().range_bias_m;
}

TEST(NeighborFilter, AtRestBearingsSayNothingOfTheDistance) {
  constexpr int kRuns = 10;
  double sum = 0.0;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) sum += range_bias_learned_at_rest(seed, 60s);

  EXPECT_NEAR(sum / kRuns, 0.0, 0.02);
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

TEST(NeighborFilter, UncertaintyGrowsWhileNothingIsMeasured) {
  SimulatedPair pair(1);
  NeighborFilter filter = tight_filter(pair, 2s);
  Matrix6d before = filter.pose_covariance();
  for (int i = 0; i < 10; ++i) {
    const Timestamp next = filter.stamp() + 100ms;
    pair.sample_imus(next);

    filter.advance_to(next, pair.imu_B, pair.imu_N);

    const Matrix6d after = filter.pose_covariance();
    EXPECT_GT((after.topLeftCorner<3, 3>().trace()), (before.topLeftCorner<3, 3>().trace()));
    EXPECT_GT((after.bottomRightCorner<3, 3>().trace()),
              (before.bottomRightCorner<3, 3>().trace()));
    before = after;
  }
}

TEST(NeighborFilter, AGatedOrDegenerateReadingChangesNothing) {
  SimulatedPair pair(2);
  NeighborFilter filter = tight_filter(pair, 1s);
  const ErrorState::Covariance P = filter.covariance();
  const Pose T_B_N = filter.motion().T_B_N;
  RangeReading outlier = pair.range(filter.stamp());
  outlier.range_m += 3.0;
  DirectionReading behind = pair.bearing(filter.stamp());
  behind.u = -behind.u;

  const Fusion far =
      filter.fuse_range(outlier, pair.mounting_B.antenna, pair.mounting_N.antenna, 10.8);
  EXPECT_EQ(far.verdict, Verdict::kGated);
  ASSERT_EQ(far.dimension, 1U);
  EXPECT_NEAR(far.residual[0], 3.0, 0.5);
  EXPECT_NEAR(far.nis, std::pow(far.residual[0] / far.sigma[0], 2), 1e-9);
  const Fusion nowhere = filter.fuse_bearing(behind, pair.mounting_N.led, 13.8);
  EXPECT_EQ(nowhere.verdict, Verdict::kDegenerate);
  EXPECT_EQ(nowhere.dimension, 0U);
  EXPECT_EQ(filter.covariance(), P);
  EXPECT_EQ(filter.motion().T_B_N.p, T_B_N.p);
  EXPECT_EQ(filter.motion().T_B_N.q.coeffs(), T_B_N.q.coeffs());
}

TEST(NeighborFilter, AGraphPoseDrawsItInByTheirCovariances) {
  SimulatedPair pair(3);
  NeighborFilter filter = tight_filter(pair, 500ms);
  const Vector6d before = pose_error(pair, filter);
  const GaussianPose sharp{pair.truth(filter.stamp()).motion.T_B_N, 1e-8 * Matrix6d::Identity()};

  EXPECT_EQ(filter.fuse_correlated_pose(sharp, kNoGate).verdict, Verdict::kFused);

  EXPECT_LT(pose_error(pair, filter).norm(), 0.01 * before.norm());
}

TEST(NeighborFilter, TheSameGraphPoseAHundredTimesSaysNoMoreThanOnce) {
  SimulatedPair pair(3);
  NeighborFilter filter = tight_filter(pair, 500ms);
  const GaussianPose pose{pair.truth(filter.stamp()).motion.T_B_N, 1e-4 * Matrix6d::Identity()};

  EXPECT_EQ(filter.fuse_correlated_pose(pose, kNoGate).verdict, Verdict::kFused);
  const double once = filter.pose_covariance().determinant();
  for (int i = 1; i < 100; ++i)
    EXPECT_EQ(filter.fuse_correlated_pose(pose, kNoGate).verdict, Verdict::kFused);

  EXPECT_GT(filter.pose_covariance().determinant(), 0.9 * once);  // weights come in steps
}

/// Root mean square position and attitude errors [m, rad] of 20 runs.
template <class Run>
Eigen::Vector2d rms_error(const Run& run) {
  constexpr int kRuns = 20;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    const Vector6d e = run(seed);
    sum += Eigen::Vector2d(e.head<3>().squaredNorm(), e.tail<3>().squaredNorm()) / kRuns;
  }
  return sum.cwiseSqrt();
}

TEST(PaperFilter, IsAtLeastAsAccurateAsTheRawPosesItIsFed) {
  const auto raw = rms_error([](std::uint64_t seed) {
    SimulatedPair pair(seed);
    const RawPose z = first_raw_pose(pair, Timestamp{4s});
    return pose_difference(z.T_B_N, pair.truth(Timestamp{4s}).motion.T_B_N);
  });

  const auto filtered = rms_error([](std::uint64_t seed) {
    SimulatedPair pair(seed);
    pair.sample_imus(Timestamp{50ms});
    ProcessNoise noise = pair.process_noise();
    noise.accel_density = 0.1;  // it has no bias states: they pass as noise
    noise.gyro_density = 0.01;
    const auto regular = [&](Timestamp t) {
      RawPose z = first_raw_pose(pair, t);
      z.covariance.diagonal().array() += 1e-6;  // the two positions tell one distance
      return z;
    };
    PaperFilter filter(Timestamp{50ms}, regular(Timestamp{50ms}), noise);
    for (Timestamp t{70ms}; t <= Timestamp{4s}; t += 20ms) {
      pair.sample_imus(t);
      filter.advance_to(t, pair.imu_B, pair.imu_N);
      EXPECT_EQ(filter.fuse(regular(t), kNoGate).verdict, Verdict::kFused);
    }
    return pose_error(pair, filter);
  });

  EXPECT_LT(filtered(0), raw(0));
  EXPECT_LT(filtered(1), raw(1));
}

}  // namespace
}  // namespace crepes
