#include "estimator/relative/neighbor_filter.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <limits>

#include "estimator/relative/bearing_measurement.hpp"
#include "estimator/relative/paper_filter.hpp"
#include "tests/support/tight_filter.hpp"

namespace crepes::neighbor_filter_test {
namespace {

using namespace std::chrono_literals;
using test::first_raw_pose;
using test::kNoGate;
using test::pose_error;
using test::SimulatedPair;
using test::tight_filter;

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
  const ErrorState::Covariance::Full P = filter.covariance().full();
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
  EXPECT_EQ(filter.covariance().full(), P);
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
      z.covariance.diagonal().array() += 1e-6;  // the two positions determine one distance
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

/// The variance of a turn about this axis.
double turn_variance(const NeighborFilter& filter, const Eigen::Vector3d& axis_N) {
  return axis_N.dot(filter.pose_covariance().bottomRightCorner<3, 3>() * axis_N);
}

TEST(NeighborFilter, HeldHeadingIsNotCorrectedAndStaysAsUncertain) {
  SimulatedPair pair(4);
  pair.sample_imus(Timestamp{test::kStart});
  const Pose truth = pair.truth(Timestamp{test::kStart}).motion.T_B_N;
  const GaussianPose start{truth, 0.04 * Matrix6d::Identity()};
  NeighborFilter held(Timestamp{test::kStart}, start, pair.process_noise(), pair.priors());
  const Eigen::Vector3d up_N = so3_exp({0.1, -0.2, 0.4}) * Eigen::Vector3d::UnitZ();
  NeighborFilter estimated = held;
  held.hold_heading(up_N);
  const double before = turn_variance(held, up_N);

  test::run(held, pair, 1s);
  test::run(estimated, pair, 1s);

  const Eigen::Quaterniond turn = pair.imu_N.rotation(Timestamp{test::kStart}, held.stamp());
  const Eigen::Vector3d up_then = turn.conjugate() * up_N;
  EXPECT_NEAR(std::sqrt(turn_variance(held, up_then)), std::sqrt(before), 0.02 * std::sqrt(before));
  EXPECT_LT(turn_variance(estimated, up_then), 0.5 * before);

  held.release_heading();
  test::run(held, pair, 1s);
  EXPECT_LT(turn_variance(held, up_then), 0.5 * before);
}

}  // namespace
}  // namespace crepes::neighbor_filter_test
