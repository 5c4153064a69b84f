#include "estimator/swarm/gaussian_sum.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "tests/support/resting_pair.hpp"
#include "tests/support/simulated_pair.hpp"

namespace crepes::gaussian_sum_test {
namespace {

using namespace test::resting;

Pose turned(double yaw_rad) {
  Vector6d turn = Vector6d::Zero();
  turn(5) = yaw_rad;
  return perturbed(kTruth, turn);
}

const ImuHistory kAtRest = imu_at_rest(500);

GaussianSum sum_of(const std::vector<Pose>& poses) {
  std::vector<NeighborTrack> parts;
  for (const Pose& pose : poses) parts.push_back(track_at(at_ms(0), {pose, covariance()}));
  return GaussianSum(std::move(parts));
}

Association fuse(GaussianSum& sum, const Measurement& z) {
  return sum.fuse({&z, 1}, kMounting, settings().gates);
}

TEST(GaussianSum, OfANarrowTrackIsThatTrack) {
  const GaussianSum sum(track_at(at_ms(0)));

  ASSERT_EQ(sum.size(), 1U);
  EXPECT_EQ(sum.heaviest().pose().covariance, covariance());
}

TEST(GaussianSum, SplitsAWideAttitudeAndKeepsItsMeanAndCovariance) {
  Matrix6d wide = covariance();
  wide(3, 3) = 0.2 * 0.2;  // roll
  const NeighborTrack whole = track_at(at_ms(0), {kTruth, wide});

  const GaussianSum sum(whole);

  EXPECT_GT(sum.size(), 5U);
  const GaussianPose mean = sum.mean(sum.heaviest(), kAtRest, kAtRest);
  EXPECT_LT(pose_difference(kTruth, mean.pose).norm(), 1e-6);
  EXPECT_NEAR(std::sqrt(mean.covariance(3, 3)), 0.2, 0.005);
  EXPECT_NEAR(mean.covariance(0, 0), wide(0, 0), 1e-9);
  EXPECT_LT(sum.heaviest().pose().covariance(3, 3), 0.25 * wide(3, 3));
}

// Readings since the sum was formed have told the heaviest part what others knew before.
TEST(GaussianSum, IsNeverMoreCertainThanItsHeaviestPart) {
  const Matrix6d certain = 0.01 * covariance();
  std::vector<NeighborTrack> parts{track_at(at_ms(0)), track_at(at_ms(0)),
                                   track_at(at_ms(0), {kTruth, certain})};
  const GaussianSum sum(std::move(parts));
  const GaussianPose mean = sum.mean(track_at(at_ms(0), {kTruth, certain}), kAtRest, kAtRest);
  const Matrix6d more = mean.covariance - certain;
  EXPECT_GE(Eigen::SelfAdjointEigenSolver<Matrix6d>(more).eigenvalues().minCoeff(), -1e-12);
}

// The parts differ along the line of sight, which lies elsewhere in the body half a second later.
TEST(GaussianSum, WhatItsPartsDifferByTurnsWithTheRobot) {
  const ImuHistory imu_B = imu_that_turns(0, 500);
  const Pose farther{kTruth.p + Eigen::Vector3d::UnitX(), kTruth.q};
  const GaussianSum sum = sum_of({kTruth, farther});
  NeighborTrack heaviest = sum.heaviest();
  heaviest.advance_to(at_ms(500), imu_B, kAtRest);

  const GaussianPose mean = sum.mean(heaviest, imu_B, kAtRest);

  const Eigen::Vector3d line = after_turn(Eigen::Vector3d::UnitX(), 500);
  EXPECT_LT((mean.pose.p - (kDistance + 0.5) * line).norm(), 1e-6);
  const Eigen::Matrix3d more = (mean.covariance - heaviest.pose().covariance).topLeftCorner<3, 3>();
  EXPECT_NEAR(line.dot(more * line), 0.25, 1e-6);
  EXPECT_NEAR(more.trace(), 0.25, 1e-6);
}

TEST(GaussianSum, PeerBearingsSelectTheHeading) {
  GaussianSum sum = sum_of({turned(0.4), turned(0.0), turned(-0.4)});

  for (int i = 0; i < 3; ++i) fuse(sum, peer_bearing(at_ms(0)));
  sum.prune();

  EXPECT_EQ(sum.size(), 1U);
  EXPECT_LT(pose_difference(kTruth, sum.heaviest().pose().pose).tail<3>().norm(), 0.05);
}

TEST(GaussianSum, OwnBearingsCannotSelectAHeading) {
  GaussianSum sum = sum_of({turned(0.4), turned(0.0), turned(-0.4)});

  fuse(sum, bearing(at_ms(0)));
  sum.prune();

  EXPECT_EQ(sum.size(), 3U);
}

TEST(GaussianSum, PruneMergesEqualParts) {
  GaussianSum sum = sum_of({turned(0.0), turned(0.4), turned(0.001)});

  sum.prune();

  EXPECT_EQ(sum.size(), 2U);
}

TEST(GaussianSum, ChoosesOneOfSeveralAlternatives) {
  GaussianSum sum = sum_of({kTruth});
  const std::array candidates{bearing(at_ms(0), 0.5), bearing(at_ms(0), 0.001)};

  const Association association = sum.fuse(candidates, kMounting, settings().gates);

  EXPECT_EQ(association.chosen, 1U);
  EXPECT_EQ(association.fusion.verdict, Verdict::kFused);
  EXPECT_GT(association.score, 0.0);
}

TEST(GaussianSum, AGatedReadingHasNoScore) {
  GaussianSum sum = sum_of({kTruth, turned(0.4)});

  const Association association = fuse(sum, bearing(at_ms(0), 1.0));

  EXPECT_EQ(association.fusion.verdict, Verdict::kGated);
  EXPECT_NEAR(association.score, 0.0, 1e-12);
}

TEST(GaussianSum, ANoisyReadingDoesNotMakeAnUnlikelyPartLikely) {
  const Pose beside{{kDistance, 0.02, 0.0}, Eigen::Quaterniond::Identity()};
  Matrix6d narrow = covariance();
  narrow.topLeftCorner<3, 3>() = 1e-6 * Eigen::Matrix3d::Identity();
  GaussianSum sum(
      std::vector{track_at(at_ms(0), {kTruth, narrow}), track_at(at_ms(0), {beside, narrow})});
  for (int i = 0; i < 3; ++i) fuse(sum, bearing(at_ms(0), 0.001));

  // Barely gated by the likely part. The other one admits it.
  const auto verdict_at = [](GaussianSum copy, double azimuth_rad) {
    return fuse(copy, bearing(at_ms(0), azimuth_rad)).fusion.verdict;
  };
  double azimuth_rad = 0.0;
  while (verdict_at(sum, azimuth_rad) == Verdict::kFused) azimuth_rad += 1e-4;
  fuse(sum, bearing(at_ms(0), azimuth_rad));

  EXPECT_LT(sum.heaviest().pose().pose.p.y(), 0.01);
}

TEST(GaussianSum, IsCompatibleWithANearPoseButNotWithAMirrorImage) {
  const GaussianSum sum = sum_of({kTruth});
  const Pose image{{0.0, kDistance, 0.0}, so3_exp({0.0, 0.0, 0.5 * std::numbers::pi})};

  EXPECT_TRUE(sum.is_compatible_with(sum_of({turned(0.02)})));
  EXPECT_FALSE(sum.is_compatible_with(sum_of({image})));
}

TEST(LogLikelihoodRatio, ComparesAReadingWithClutterAndIsNeverNegativeForAGatedOne) {
  Fusion fusion{.verdict = Verdict::kFused};
  fusion.log_likelihood = 5.0;

  EXPECT_GT(log_likelihood_ratio(fusion, MeasurementKind::kBearing), 5.0);
  EXPECT_GT(log_likelihood_ratio(fusion, MeasurementKind::kRange),
            log_likelihood_ratio(fusion, MeasurementKind::kBearing));
  const double fused = log_likelihood_ratio(fusion, MeasurementKind::kBearing);
  fusion.verdict = Verdict::kGated;
  EXPECT_EQ(log_likelihood_ratio(fusion, MeasurementKind::kBearing), fused);
  fusion.log_likelihood = -20.0;  // more likely clutter
  EXPECT_EQ(log_likelihood_ratio(fusion, MeasurementKind::kBearing), 0.0);
  fusion.verdict = Verdict::kSkipped;
  EXPECT_EQ(log_likelihood_ratio(fusion, MeasurementKind::kBearing), 0.0);
}

/// Ten seconds of a pair of which only we see the other one: whether a pose that is certain enough
/// to be published is ever beyond five sigma.
bool is_dishonest(std::uint64_t seed) {
  test::PairNoise noise;
  noise.bearing = 0.002;
  noise.tilt = 0.06;
  noise.priors.accel_bias_mps2 = 0.035;
  test::SimulatedPair pair(seed, noise);
  pair.set_pace(0.4);
  FilterSettings of_pair = settings();
  of_pair.priors = pair.priors();
  of_pair.noise = pair.process_noise();
  const Timestamp begin = at_ms(50);
  pair.sample_imus(begin);
  const MutualSighting both = pair.sighting(begin);
  Sighting seen = both.N;
  seen.u.setZero();
  const OneWayInitialization start{
      poses_by_heading(both.B, seen, both.range_m, both.range_sigma_m, 24), FilterAxes::kOurs,
      seen.up};
  std::vector<NeighborTrack> parts;
  for (const GaussianPose& pose : start.T_seer_seen)
    parts.emplace_back(begin, pose, start, of_pair);
  GaussianSum sum(std::move(parts));
  const PairMounting mounting{pair.mounting_B.led, pair.mounting_B.antenna, pair.mounting_N.led,
                              pair.mounting_N.antenna};
  const auto add = [&](Timestamp t, MeasurementKind kind, const auto& reading) {
    const Measurement z{t, kind, reading};
    static_cast<void>(sum.fuse({&z, 1}, mounting, of_pair.gates));
  };
  for (int tick = 1; tick <= 1000; ++tick) {
    const Timestamp t = at_ms(50 + 10 * tick);
    pair.sample_imus(t);
    sum.advance_to(t, pair.imu_B, pair.imu_N);
    if (tick % 2 == 0) add(t, MeasurementKind::kBearing, pair.bearing(t));
    if (tick % 50 == 1) add(t, MeasurementKind::kRange, pair.range(t));
    sum.prune();
    const GaussianPose said = sum.mean(sum.heaviest(), pair.imu_B, pair.imu_N);
    if (tick % 5 != 0 || !is_certain(said.covariance)) continue;
    const Vector6d e = pose_difference(said.pose, pair.truth(t).motion.T_B_N);
    const Eigen::Matrix3d cov_p = said.covariance.topLeftCorner<3, 3>();
    const Eigen::Matrix3d cov_theta = said.covariance.bottomRightCorner<3, 3>();
    if (e.head<3>().dot(cov_p.inverse() * e.head<3>()) > 35.0 ||
        e.tail<3>().dot(cov_theta.inverse() * e.tail<3>()) > 35.0)
      return true;
  }
  return false;
}

// Seven of these pairs have false poses if headings are estimated from the start, with all evidence
// and in coordinates of how the other one would see us; two to five if one of these is changed.
TEST(OpenHeading, IsFoundHonestlyByRobotsThatMoveSlowly) {
  int dishonest = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) dishonest += is_dishonest(seed) ? 1 : 0;
  EXPECT_LE(dishonest, 1);
}

}  // namespace
}  // namespace crepes::gaussian_sum_test
