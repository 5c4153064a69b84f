#include "estimator/swarm/hypothesis_set.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <span>

#include "tests/support/resting_pair.hpp"

namespace crepes::hypothesis_set_test {
namespace {

using std::chrono::milliseconds;

using namespace test::resting;

/// `count` filters of a robot four meters ahead, which differ in its heading.
OneWayInitialization headings(int count) {
  OneWayInitialization start;
  start.up_seen = Eigen::Vector3d::UnitZ();
  const Vector6d sigma{{0.1, 0.1, 0.1, 0.02, 0.02, 0.02}};
  for (int i = 0; i < count; ++i) {
    Vector6d turn = Vector6d::Zero();
    turn(5) = 0.3 * i / count;
    start.T_seer_seen.push_back({perturbed(kTruth, turn), sigma.cwiseAbs2().asDiagonal()});
  }
  return start;
}

ImuSample at_rest(Timestamp t) {
  return {.stamp = t,
          .gyro_radps = Eigen::Vector3d::Zero(),
          .accel_mps2 = Eigen::Vector3d(0.0, 0.0, 9.81)};
}

Measurement reading(MeasurementKind kind, Timestamp t) {
  if (kind == MeasurementKind::kRange) return {t, kind, RangeReading{4.0, 0.05}};
  const double side = kind == MeasurementKind::kBearing ? 1.0 : -1.0;
  return {t, kind,
          DirectionReading{side * Eigen::Vector3d::UnitX(), Eigen::Vector3d::Zero(), 0.001}};
}

constexpr int kSeconds = 10;

/// How many readings of each kind `count` filters take in the first and in the last of ten seconds,
/// of 200, 200 and 50.
std::array<std::map<MeasurementKind, int>, 2> taken_by(int count) {
  HypothesisSet hypotheses(filter_settings({}), kMounting);
  ImuHistory imu;
  EXPECT_TRUE(hypotheses.initialize(Timestamp{}, headings(count)));
  std::array<std::map<MeasurementKind, int>, kSeconds> taken;
  for (int ms = 0; ms < kSeconds * 1000; ++ms) {
    const Timestamp t{milliseconds{ms}};
    const auto offer = [&](MeasurementKind kind) {
      const Measurement one = reading(kind, t);
      const Fusion fusion = hypotheses.fuse({&one, 1}, imu, imu).fusion;
      if (fusion.verdict != Verdict::kSkipped) ++taken.at(ms / 1000)[kind];
    };
    if (ms % 10 == 0) imu.push(at_rest(t));
    if (ms % 5 == 0) offer(MeasurementKind::kBearing);
    if (ms % 5 == 1) offer(MeasurementKind::kPeerBearing);
    if (ms % 20 == 2) offer(MeasurementKind::kRange);
  }
  return {taken.front(), taken.back()};
}

// A slow computer that has too much to do falls behind, and has more to do for that.
TEST(HypothesisSet, TakeFewerReadingsTheMoreFiltersThereAreForLong) {
  const std::map all{std::pair{MeasurementKind::kBearing, 200},
                     std::pair{MeasurementKind::kPeerBearing, 200},
                     std::pair{MeasurementKind::kRange, 50}};
  EXPECT_EQ(taken_by(1)[1], all);
  EXPECT_EQ(taken_by(4)[1], all);
  EXPECT_EQ(taken_by(19)[0], all) << "a start has time";
  for (const int filters : {40, 160}) {
    const auto last = taken_by(filters)[1];
    ASSERT_EQ(last.size(), 3U) << "a kind goes without";
    const int most = 1000 / filters + 1;
    for (const auto& [kind, count] : last) {
      EXPECT_LE(count, most) << name_of(kind) << ", " << filters << " filters";
      EXPECT_GE(count, most / 2) << name_of(kind) << ", " << filters << " filters";
    }
  }
}

/// Feeds both directions' bearings at 100 Hz, with `azimuth_rad` for our own, from `from_ms` on.
void feed(HypothesisSet& hypotheses, int from_ms, int count, double azimuth_rad = 0.0,
          bool with_peer = true) {
  const ImuHistory imu = imu_at_rest(2500);
  for (int ms = from_ms; ms < from_ms + 10 * count; ms += 10) {
    const Measurement own = bearing(at_ms(ms), azimuth_rad);
    hypotheses.fuse({&own, 1}, imu, imu);
    const Measurement by_peer = peer_bearing(at_ms(ms));
    if (with_peer) hypotheses.fuse({&by_peer, 1}, imu, imu);
    hypotheses.prune();
  }
}

constexpr double kMirror = 1.5;  // rad, azimuth of the image

/// As `feed`, with ranges, so that the pose stays certain; our camera may see the image, too.
void feed_ranged(HypothesisSet& hypotheses, int from_ms, int count, bool with_image) {
  const ImuHistory imu = imu_at_rest(2500);
  for (int ms = from_ms; ms < from_ms + 10 * count; ms += 10) {
    const Timestamp t = at_ms(ms);
    const std::array own{bearing(t, 0.0), bearing(t, kMirror)};
    hypotheses.fuse(std::span(own).first(with_image ? 2 : 1), imu, imu);
    for (const Measurement& other : {peer_bearing(t), range(t)})
      hypotheses.fuse({&other, 1}, imu, imu);
    hypotheses.prune();
  }
}

Tilt tilt(double roll_rad) {
  return {.stamp = at_ms(0),
          .up_B = Eigen::Vector3d(0.0, std::sin(roll_rad), std::cos(roll_rad)),
          .sigma_rad = 0.05};
}

// It may be the image: then the pose is tilted, and readings of the robot do not fit.
TEST(Hypotheses, ATiltedOneBesideWhichReadingsDoNotFitIsWithheldAndAdmitsRivals) {
  constexpr double kTilted = 0.3;  // rad
  HypothesisSet hypotheses(settings(), kMounting);
  ASSERT_TRUE(hypotheses.initialize(at_ms(0), sighting()));

  feed_ranged(hypotheses, 10, 190, false);
  hypotheses.compare_tilts(tilt(kTilted), tilt(0.0));
  EXPECT_TRUE(hypotheses.is_unambiguous()) << "nothing else is seen: tilts may err";
  EXPECT_FALSE(hypotheses.accepts_raw_pose(at_ms(1910)));

  feed_ranged(hypotheses, 1910, 20, true);
  EXPECT_FALSE(hypotheses.is_unambiguous());
  EXPECT_TRUE(hypotheses.accepts_raw_pose(at_ms(2110)));

  hypotheses.compare_tilts(tilt(kTilted), tilt(kTilted));
  EXPECT_TRUE(hypotheses.is_unambiguous()) << "the other one is the image";
  EXPECT_FALSE(hypotheses.accepts_raw_pose(at_ms(2110)));
}

TEST(Hypotheses, OneSightingStartsATrackButDoesNotConfirmIt) {
  HypothesisSet hypotheses(settings(), kMounting);
  EXPECT_TRUE(hypotheses.accepts_raw_pose(at_ms(0)));

  EXPECT_TRUE(hypotheses.initialize(at_ms(0), sighting()));

  EXPECT_EQ(hypotheses.size(), 1U);
  EXPECT_FALSE(hypotheses.is_unambiguous());
  EXPECT_LT(pose_difference(kTruth, hypotheses.leader().heaviest().pose().pose).norm(), 0.1);
}

TEST(Hypotheses, BearingsOfBothDirectionsConfirm) {
  HypothesisSet hypotheses(settings(), kMounting);
  ASSERT_TRUE(hypotheses.initialize(at_ms(0), sighting()));

  feed(hypotheses, 10, 20);

  EXPECT_TRUE(hypotheses.is_unambiguous());
}

TEST(Hypotheses, BearingsOfOneDirectionDoNotConfirmAndAfterASecondTheTrackIsDeleted) {
  HypothesisSet hypotheses(settings(), kMounting);
  ASSERT_TRUE(hypotheses.initialize(at_ms(0), sighting()));

  feed(hypotheses, 10, 90, 0.0, false);
  EXPECT_FALSE(hypotheses.empty());
  EXPECT_FALSE(hypotheses.is_unambiguous());
  feed(hypotheses, 910, 20, 0.0, false);

  EXPECT_TRUE(hypotheses.empty());
}

TEST(Hypotheses, ATrackThatBecameUncertainOutOfSightIsDropped) {
  HypothesisSet hypotheses(settings(), kMounting);
  ASSERT_TRUE(hypotheses.initialize(at_ms(0), sighting()));
  feed(hypotheses, 10, 20);
  const ImuHistory imu = imu_at_rest(30000);
  int s = 1;
  for (; s < 30 && hypotheses.leader().heaviest().is_certain(); ++s) {
    hypotheses.prune();
    ASSERT_TRUE(hypotheses.is_unambiguous()) << s;
    hypotheses.advance_to(Timestamp{std::chrono::seconds{s}}, imu, imu);
  }
  ASSERT_LT(s, 30);

  hypotheses.prune();

  EXPECT_TRUE(hypotheses.empty());
}

TEST(Hypotheses, AReadingAfterALongPauseDoesNotMakeAnUncertainTrackCertain) {
  HypothesisSet hypotheses(settings(), kMounting);
  ASSERT_TRUE(hypotheses.initialize(at_ms(0), sighting()));
  feed(hypotheses, 10, 20);
  const ImuHistory imu = imu_at_rest(30000);
  const Measurement z = bearing(at_ms(30000));

  const Association association = hypotheses.fuse({&z, 1}, imu, imu);

  EXPECT_EQ(association.fusion.verdict, Verdict::kNoState);
  EXPECT_TRUE(hypotheses.empty());
}

TEST(Hypotheses, AnExplainedSightingStartsNoRival) {
  HypothesisSet hypotheses(settings(), kMounting);
  ASSERT_TRUE(hypotheses.initialize(at_ms(0), sighting()));

  EXPECT_FALSE(hypotheses.initialize(at_ms(0), sighting(0.001)));

  EXPECT_EQ(hypotheses.size(), 1U);
  EXPECT_EQ(hypotheses.generation(), 1U);
}

TEST(Hypotheses, AMirrorImageStartsARival) {
  HypothesisSet hypotheses(settings(), kMounting);
  ASSERT_TRUE(hypotheses.initialize(at_ms(0), sighting()));

  EXPECT_TRUE(hypotheses.initialize(at_ms(0), sighting(kMirror)));

  EXPECT_EQ(hypotheses.size(), 2U);
}

TEST(Hypotheses, TheRivalWithMoreSupportBecomesTheLeader) {
  HypothesisSet hypotheses(settings(), kMounting);
  ASSERT_TRUE(hypotheses.initialize(at_ms(0), sighting(kMirror)));
  ASSERT_TRUE(hypotheses.initialize(at_ms(0), sighting()));

  feed(hypotheses, 10, 150);

  EXPECT_EQ(hypotheses.generation(), 2U);
  EXPECT_EQ(hypotheses.size(), 1U) << "the image has lost";
  EXPECT_TRUE(hypotheses.is_unambiguous());
  EXPECT_LT(pose_difference(kTruth, hypotheses.leader().heaviest().pose().pose).norm(), 0.1);
}

// Its own score is that of half a second, the rival's that of its life. Our bearings fit both, and
// the peer has few.
TEST(Hypotheses, AnOldLeaderThatThePeerContradictsHasNoAdvantageByItsAge) {
  constexpr double kTurned = std::numbers::pi + 0.2;  // of the peer, since
  constexpr int kTurn_ms = 1500;
  HypothesisSet hypotheses(settings(), kMounting);
  ASSERT_TRUE(hypotheses.initialize(at_ms(0), sighting()));
  const ImuHistory imu = imu_at_rest(3000);
  const auto look = [&](int from_ms, int to_ms, double peer_azimuth_rad) {
    for (int ms = from_ms; ms < to_ms; ms += 5) {
      const Measurement own = bearing(at_ms(ms));
      hypotheses.fuse({&own, 1}, imu, imu);
      const Measurement by_peer = peer_bearing(at_ms(ms), peer_azimuth_rad);
      if (ms % 40 == 0) hypotheses.fuse({&by_peer, 1}, imu, imu);
      hypotheses.prune();
    }
  };
  look(5, kTurn_ms, std::numbers::pi);
  look(kTurn_ms, kTurn_ms + 500, kTurned);
  ASSERT_EQ(hypotheses.generation(), 1U);
  ASSERT_TRUE(hypotheses.initialize(hypotheses.stamp(), sighting(0.0, kTurned)));

  look(kTurn_ms + 500, kTurn_ms + 900, kTurned);

  EXPECT_EQ(hypotheses.generation(), 2U);
  EXPECT_TRUE(hypotheses.is_unambiguous());
}

TEST(Hypotheses, AreAmbiguousWhileBothPlacesAreSeen) {
  HypothesisSet hypotheses(settings(), kMounting);
  ASSERT_TRUE(hypotheses.initialize(at_ms(0), sighting()));
  ASSERT_TRUE(hypotheses.initialize(at_ms(0), sighting(kMirror)));
  const ImuHistory imu = imu_at_rest(1000);

  for (int ms = 10; ms < 500; ms += 10) {
    const std::array both{bearing(at_ms(ms)), bearing(at_ms(ms), kMirror)};
    hypotheses.fuse(both, imu, imu);
    const Measurement by_peer = peer_bearing(at_ms(ms));
    hypotheses.fuse({&by_peer, 1}, imu, imu);
    hypotheses.prune();
  }

  EXPECT_EQ(hypotheses.size(), 2U);
  EXPECT_FALSE(hypotheses.is_unambiguous());
}

TEST(Hypotheses, AOneWayTrackStartsOnlyIfThereIsNone) {
  HypothesisSet hypotheses(settings(), kMounting);
  ASSERT_TRUE(hypotheses.initialize(at_ms(0), sighting()));

  EXPECT_FALSE(hypotheses.initialize(at_ms(0), headings(3)));
  hypotheses.clear();
  EXPECT_TRUE(hypotheses.initialize(at_ms(0), headings(3)));
  EXPECT_EQ(hypotheses.leader().size(), 3U);
}

TEST(Hypotheses, AKnownHeadingReplacesAnOpenOneOnly) {
  HypothesisSet hypotheses(settings(), kMounting);
  const OneWayInitialization known{{{kTruth, covariance()}}};
  ASSERT_TRUE(hypotheses.initialize(at_ms(0), headings(24)));
  ASSERT_TRUE(hypotheses.has_open_heading());

  EXPECT_TRUE(hypotheses.initialize(at_ms(0), known));

  EXPECT_EQ(hypotheses.leader().size(), 1U);
  EXPECT_FALSE(hypotheses.has_open_heading());
  EXPECT_FALSE(hypotheses.initialize(at_ms(0), known));
}

TEST(Hypotheses, TheGraphsPoseReplacesAll) {
  HypothesisSet hypotheses(settings(), kMounting);
  ASSERT_TRUE(hypotheses.initialize(at_ms(0), sighting()));
  ASSERT_TRUE(hypotheses.initialize(at_ms(0), sighting(kMirror)));

  EXPECT_TRUE(hypotheses.initialize(at_ms(0), GraphPose{RobotId{2}, {kTruth, covariance()}}));

  EXPECT_EQ(hypotheses.size(), 1U);
  EXPECT_TRUE(hypotheses.is_unambiguous());
  EXPECT_EQ(hypotheses.generation(), 3U);
}

TEST(Hypotheses, AreBounded) {
  HypothesisSet hypotheses(settings(), kMounting);
  for (int i = 0; i < 30; ++i)
    static_cast<void>(hypotheses.initialize(at_ms(0), sighting(0.2 * i)));

  EXPECT_EQ(hypotheses.size(), 8U);
}

TEST(Hypotheses, AnotherProfileDropsThemAndOtherNoiseDoesNot) {
  HypothesisSet hypotheses(settings(), kMounting);
  ASSERT_TRUE(hypotheses.initialize(at_ms(0), sighting()));
  FilterSettings noisy = settings();
  noisy.noise.accel_density *= 2.0;

  hypotheses.reconfigure(noisy);
  EXPECT_EQ(hypotheses.size(), 1U);
  hypotheses.reconfigure(settings(Profile::kPaper));
  EXPECT_TRUE(hypotheses.empty());
}

TEST(Hypotheses, UnderThePapersProfileEveryRawPoseReplacesTheFilter) {
  HypothesisSet hypotheses(settings(Profile::kPaper), kMounting);

  ASSERT_TRUE(hypotheses.initialize(at_ms(0), sighting(kMirror)));
  EXPECT_TRUE(hypotheses.is_unambiguous());
  ASSERT_TRUE(hypotheses.initialize(at_ms(0), sighting()));

  EXPECT_EQ(hypotheses.size(), 1U);
  EXPECT_EQ(hypotheses.generation(), 2U);
}

TEST(CorrectionBudget, RefillsByTheSecondUpToABurst) {
  CorrectionBudget budget;
  ASSERT_TRUE(budget.allows(at_ms(0)));

  budget.spend(8000);
  EXPECT_FALSE(budget.allows(at_ms(0)));
  EXPECT_TRUE(budget.allows(at_ms(1000), 999.0));
  EXPECT_FALSE(budget.allows(at_ms(1000), 1000.0));
  EXPECT_FALSE(budget.allows(at_ms(100'000), 8000.0));
  EXPECT_TRUE(budget.allows(at_ms(100'000), 7999.0));
}

}  // namespace
}  // namespace crepes::hypothesis_set_test
