#include "estimator/swarm/neighbor_track.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "estimator/relative/arc_pose.hpp"
#include "tests/support/resting_pair.hpp"
#include "tests/support/simulated_pair.hpp"

namespace crepes::neighbor_track_test {
namespace {

using namespace test::resting;

/// A track that bearings have made certain, and the means to move it.
class RestingTrack : public testing::Test {
 protected:
  Fusion fuse_at(int ms, Measurement z) {
    track_.advance_to(at_ms(ms), imu_, imu_);
    z.stamp = at_ms(ms);
    return fuse(track_, z);
  }

  ImuHistory imu_ = imu_at_rest(2000);
  NeighborTrack track_ = track_at(at_ms(0));
};

TEST_F(RestingTrack, RemembersWhenAReadingOfEachKindWasUsed) {
  EXPECT_EQ(track_.last(MeasurementKind::kBearing), kNever);
  EXPECT_EQ(track_.last_sighting(), kNever);

  ASSERT_EQ(fuse_at(20, bearing({})).verdict, Verdict::kFused);
  ASSERT_EQ(fuse_at(30, range({})).verdict, Verdict::kFused);

  EXPECT_EQ(track_.last(MeasurementKind::kBearing), at_ms(20));
  EXPECT_EQ(track_.last(MeasurementKind::kRange), at_ms(30));
  EXPECT_EQ(track_.last_sighting(), at_ms(20));
}

TEST_F(RestingTrack, HasDivergedWhenAllBearingsOfAQuarterSecondWereGated) {
  for (int ms = 0; ms < 250; ms += 10) {
    EXPECT_FALSE(track_.is_diverged()) << ms;
    ASSERT_EQ(fuse_at(ms, bearing({}, 1.0)).verdict, Verdict::kGated);
  }
  ASSERT_EQ(fuse_at(250, bearing({}, 1.0)).verdict, Verdict::kGated);

  EXPECT_TRUE(track_.is_diverged());
}

TEST_F(RestingTrack, HasNotDivergedWhileSomeBearingsFit) {
  for (int ms = 0; ms < 1000; ms += 10) {
    const bool fits = ms % 200 == 0;
    ASSERT_EQ(fuse_at(ms, bearing({}, fits ? 0.0 : 1.0)).verdict,
              fits ? Verdict::kFused : Verdict::kGated);

    EXPECT_FALSE(track_.is_diverged()) << ms;
  }
}

TEST_F(RestingTrack, HasNotDivergedByAFewGatedBearings) {
  for (int ms = 0; ms <= 256; ms += 32) {
    ASSERT_EQ(fuse_at(ms, bearing({}, 1.0)).verdict, Verdict::kGated);
  }

  EXPECT_FALSE(track_.is_diverged());  // nine, for longer than a quarter second
}

TEST_F(RestingTrack, IsContradictedByBearingsInARowAfterAGapUntilOneFits) {
  ASSERT_EQ(fuse_at(0, bearing({})).verdict, Verdict::kFused);
  for (const int ms : {200, 210}) ASSERT_EQ(fuse_at(ms, bearing({}, 1.0)).verdict, Verdict::kGated);
  EXPECT_FALSE(track_.is_contradicted());
  ASSERT_EQ(fuse_at(220, bearing({}, 1.0)).verdict, Verdict::kGated);
  EXPECT_TRUE(track_.is_contradicted());

  ASSERT_EQ(fuse_at(230, peer_bearing({})).verdict, Verdict::kFused);
  EXPECT_FALSE(track_.is_contradicted());  // a mirror image in our camera
}

TEST_F(RestingTrack, IsContradictedByBearingsThatStopToFitWithoutAGap) {
  ASSERT_EQ(fuse_at(0, bearing({})).verdict, Verdict::kFused);
  for (int ms = 10; ms <= 400; ms += 10) {
    ASSERT_EQ(fuse_at(ms, bearing({}, 1.0)).verdict, Verdict::kGated);
    EXPECT_EQ(track_.is_contradicted(), ms >= 250) << ms;
  }
}

TEST_F(RestingTrack, IsContradictedByRangesInARowUntilOneFits) {
  for (const int ms : {0, 10, 20, 30})
    ASSERT_EQ(fuse_at(ms, range({}, kDistance)).verdict, Verdict::kFused);
  for (const int ms : {40, 50}) ASSERT_EQ(fuse_at(ms, range({}, 7.0)).verdict, Verdict::kGated);
  EXPECT_FALSE(track_.is_contradicted());
  ASSERT_EQ(fuse_at(60, range({}, 7.0)).verdict, Verdict::kGated);
  EXPECT_TRUE(track_.is_contradicted());

  ASSERT_EQ(fuse_at(70, range({}, kDistance)).verdict, Verdict::kFused);
  EXPECT_FALSE(track_.is_contradicted());
}

// Which of them are false is not known: the first one may be.
TEST_F(RestingTrack, IsContradictedByAsManyRangesAsEverFitted) {
  int ms = 0;
  for (const int fitted : {1, 2, 3}) {
    ASSERT_EQ(fuse_at(ms += 10, range({}, kDistance)).verdict, Verdict::kFused);
    EXPECT_FALSE(track_.is_contradicted()) << ms;
    for (int gated = 1; gated <= fitted; ++gated) {
      ASSERT_EQ(fuse_at(ms += 10, range({}, 7.0)).verdict, Verdict::kGated);
      EXPECT_EQ(track_.is_contradicted(), gated == fitted) << ms;
    }
  }
}

/// A track that six seconds of ranges have made certain of its speed, too.
class RangedTrack : public RestingTrack {
 protected:
  static constexpr int kRangedMs = 6000;

  RangedTrack() {
    imu_ = {};
    for (int ms = 0; ms < kRangedMs; ms += 10) {
      add_sightings(ms);
      EXPECT_EQ(fuse_at(ms, range({})).verdict, Verdict::kFused);
    }
  }
  /// Both robots see each other, and rest.
  void add_sightings(int ms) {
    imu_.push({at_ms(ms), Eigen::Vector3d::Zero(), {0.0, 0.0, kGravityMps2}});
    fuse_at(ms, bearing({}));
    fuse_at(ms, peer_bearing({}));
  }
};

// Two modules take turns, two seconds apart.
TEST_F(RangedTrack, AcceptsAnotherDistanceAfterAFewRareRanges) {
  for (int ms = kRangedMs; ms <= kRangedMs + 6000; ms += 10) {
    add_sightings(ms);
    const int number = (ms - kRangedMs) / 2000;
    if (ms != kRangedMs + 2000 * number) continue;
    const Measurement z = number % 2 == 0 ? range({}, 7.0) : peer_range({}, 7.0);
    ASSERT_EQ(fuse_at(ms, z).verdict, number < 3 ? Verdict::kGated : Verdict::kFused) << number;
    EXPECT_EQ(track_.is_contradicted(), number == 1 || number == 2) << number;
  }

  const double off = 7.0 - track_.pose().pose.p.x();  // after one range, which may yet be false
  EXPECT_LT(off, 1.5);
  EXPECT_LT(off, 2.0 * std::sqrt(track_.pose().covariance(0, 0)));
}

// They would not fit after a reset either: what is known is kept.
TEST_F(RangedTrack, IsNotResetByRareRangesThatAreFarOff) {
  for (int ms = kRangedMs; ms <= kRangedMs + 8000; ms += 2000) {
    for (int step = 0; step < 2000 && ms + step <= kRangedMs + 8000; step += 10)
      add_sightings(ms + step);
    if (ms < kRangedMs + 8000) {
      ASSERT_EQ(fuse_at(ms + 1990, range({}, 60.0)).verdict, Verdict::kGated);
    }
  }

  EXPECT_TRUE(track_.is_contradicted());
  EXPECT_LT(std::sqrt(track_.pose().covariance(0, 0)), 1.0);
}

// It passes behind something. Ranges that grow longer look like motion until they are refused.
TEST_F(RangedTrack, IsHonestWhereRangesGrowLongerOutOfSight) {
  constexpr double kLate = 0.5;     // m, at last
  constexpr double kOnset = 700.0;  // ms
  for (int ms = kRangedMs; ms < kRangedMs + 4000; ms += 10) {
    imu_.push({at_ms(ms), Eigen::Vector3d::Zero(), {0.0, 0.0, kGravityMps2}});
    fuse_at(ms, range({}, kDistance + kLate * (1.0 - std::exp((kRangedMs - ms) / kOnset))));
    const GaussianPose pose = track_.pose();
    const double off_m = pose.pose.p.x() - kDistance;
    ASSERT_LT(std::abs(off_m), 5.0 * std::sqrt(pose.covariance(0, 0))) << ms;
  }
}

TEST_F(RangedTrack, IsContradictedByAllRangesOfASecondUntilOneFits) {
  for (int ms = kRangedMs; ms <= kRangedMs + 1010; ms += 10) {
    add_sightings(ms);
    if (ms == kRangedMs || ms == kRangedMs + 1000) {
      ASSERT_EQ(fuse_at(ms, range({}, 7.0)).verdict, Verdict::kGated);
    }
    EXPECT_EQ(track_.is_contradicted(), ms >= kRangedMs + 1000) << ms;
  }
  ASSERT_EQ(fuse_at(kRangedMs + 1010, peer_range({})).verdict, Verdict::kFused);
  EXPECT_FALSE(track_.is_contradicted());
}

TEST_F(RestingTrack, SkipsAnotherCameraUntilTheFirstIsSilent) {
  const Eigen::Vector3d other(0.0, 0.0, 0.05);
  const Measurement by_other = bearing({}, 0.0, other);
  ASSERT_EQ(fuse_at(0, bearing({})).verdict, Verdict::kFused);

  EXPECT_EQ(fuse_at(10, by_other).verdict, Verdict::kSkipped);
  EXPECT_EQ(fuse_at(100, by_other).verdict, Verdict::kSkipped);
  EXPECT_EQ(fuse_at(110, by_other).verdict, Verdict::kFused);
  EXPECT_EQ(fuse_at(120, bearing({})).verdict, Verdict::kSkipped);
}

TEST_F(RestingTrack, PrefersTheAlternativeNearestToItsPrediction) {
  const std::array candidates{bearing(at_ms(0), 0.3), bearing(at_ms(0), -0.01),
                              bearing(at_ms(0), 0.05)};

  EXPECT_EQ(track_.most_likely(candidates, kMounting), 1U);
}

TEST_F(RestingTrack, AcceptsAnotherDistanceWhenOnlyTheRangesContradict) {
  Verdict verdict = Verdict::kSkipped;
  for (int ms = 0; ms <= 1000; ms += 10) {
    fuse_at(ms, bearing({}));
    fuse_at(ms, peer_bearing({}));
    verdict = fuse_at(ms, range({}, ms <= 300 ? kDistance : 7.0)).verdict;
    // Half a second, and some ranges more until 3 m off is more likely true than false.
    ASSERT_EQ(verdict, ms <= 300 || ms > 830 ? Verdict::kFused : Verdict::kGated) << ms;
  }

  EXPECT_EQ(verdict, Verdict::kFused);
  EXPECT_NEAR(track_.pose().pose.p.x(), 7.0, 0.5);
}

TEST_F(RestingTrack, RecordsTheCalibrationInTheOrderOfItsNames) {
  for (int ms = 0; ms <= 500; ms += 10) {
    fuse_at(ms, bearing({}, 0.002));
    fuse_at(ms, range({}, 4.1));
  }
  const auto record = track_.calibration();

  ASSERT_TRUE(record);
  EXPECT_EQ(CalibrationRecord::kNames[CalibrationRecord::kRangeBias], "range_bias");
  EXPECT_EQ(CalibrationRecord::kNames[CalibrationRecord::kMisalignB], "misalign_B_x");
  EXPECT_EQ(CalibrationRecord::kNames[CalibrationRecord::kAccelN], "accel_N_x");
  EXPECT_GT(record->value[CalibrationRecord::kRangeBias], 0.0);
  EXPECT_LT(record->sigma[CalibrationRecord::kRangeBias], settings().priors.range_bias_m);
  for (std::size_t i = 0; i < CalibrationRecord::kSize; ++i)
    EXPECT_GT(record->sigma[i], 0.0) << CalibrationRecord::kNames[i];
  EXPECT_EQ(record->stamp, at_ms(500));
}

TEST(NeighborTrack, OfThePapersProfileIsOnePartWithoutCalibration) {
  const NeighborTrack track(at_ms(0), sighting().raw, settings(Profile::kPaper));

  EXPECT_EQ(track.split().size(), 1U);
  EXPECT_FALSE(track.calibration());
  EXPECT_EQ(track.last(MeasurementKind::kRawPose), at_ms(0));
}

/// Two tracks of one pair: ours, in the neighbor's axes, and the neighbor's, in its own.
TEST(TrackInTheNeighborsAxes, IsTheNeighborsTrackOfUsInverted) {
  test::SimulatedPair pair(3);
  const Timestamp start{std::chrono::milliseconds{50}};
  pair.sample_imus(start);
  const GaussianPose T_N_B{pair.truth(start).motion.T_B_N.inverse(), covariance(0.05)};
  NeighborTrack ours(start, T_N_B, {{T_N_B}, FilterAxes::kNeighbors}, settings());
  NeighborTrack theirs(start, T_N_B, {{T_N_B}, FilterAxes::kOurs}, settings());
  const PairMounting mounting{pair.mounting_B.led, pair.mounting_B.antenna, pair.mounting_N.led,
                              pair.mounting_N.antenna};
  const PairMounting mirrored{mounting.p_N_M, mounting.p_N_Q, mounting.p_B_M, mounting.p_B_U};
  const auto fuse_both = [&](Timestamp t, MeasurementKind kind, MeasurementKind mirrored_kind,
                             const auto& reading) {
    const Measurement z{t, kind, reading};
    const Measurement mirrored_z{t, mirrored_kind, reading};
    const Fusion fusion = ours.fuse(z, mounting, settings().gates);
    EXPECT_EQ(fusion.nis, theirs.fuse(mirrored_z, mirrored, settings().gates).nis);
  };
  for (int ms = 60; ms <= 2000; ms += 10) {
    const Timestamp t = at_ms(ms);
    pair.sample_imus(t);
    ours.advance_to(t, pair.imu_B, pair.imu_N);
    theirs.advance_to(t, pair.imu_N, pair.imu_B);
    using enum MeasurementKind;
    fuse_both(t, kPeerBearing, kBearing, pair.peer_bearing(t));
    if (ms > 1000) fuse_both(t, kBearing, kPeerBearing, pair.bearing(t));
    if (ms % 40 == 0) fuse_both(t, kRange, kPeerRange, pair.range(t));
  }

  const GaussianPose T_B_N = inverse_on_arc(theirs.pose());
  EXPECT_LT(pose_difference(ours.pose().pose, T_B_N.pose).norm(), 1e-12);
  EXPECT_LT((ours.pose().covariance - T_B_N.covariance).norm(), 1e-12);
  const Vector6d e = pose_difference(T_B_N.pose, pair.truth(at_ms(2000)).motion.T_B_N);
  EXPECT_LT(e.dot(T_B_N.covariance.inverse() * e), 22.5);
  const RelativeMotion truth = pair.truth(at_ms(2000)).motion;
  EXPECT_LT((ours.motion().v_B_N - truth.v_B_N).norm(), 0.1);
  using R = CalibrationRecord;
  EXPECT_EQ(ours.calibration()->value[R::kGyroB], theirs.calibration()->value[R::kGyroN]);
  EXPECT_EQ(ours.calibration()->value[R::kMisalignN], theirs.calibration()->value[R::kMisalignB]);
  EXPECT_EQ(ours.last(MeasurementKind::kPeerBearing), at_ms(2000));
}

}  // namespace
}  // namespace crepes::neighbor_track_test
