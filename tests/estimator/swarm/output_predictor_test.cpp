#include "estimator/swarm/output_predictor.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/resting_pair.hpp"

namespace crepes::output_predictor_test {
namespace {

using namespace test::resting;

/// A confirmed track at 0 ms, and readings that wait.
class Prediction : public testing::Test {
 protected:
  Prediction() {
    EXPECT_TRUE(hypotheses_.initialize(at_ms(0), GraphPose{RobotId{2}, {kTruth, covariance()}}));
  }

  [[nodiscard]] PendingReadings readings() const { return {pending_, imu_, imu_}; }
  [[nodiscard]] NeighborTrack fresh(int ms) const {
    return OutputPredictor(kMounting, settings().gates).predict(at_ms(ms), hypotheses_, readings());
  }
  static void expect_same(const NeighborTrack& a, const NeighborTrack& b) {
    EXPECT_EQ(a.stamp(), b.stamp());
    EXPECT_EQ(a.pose().pose.p, b.pose().pose.p);
    EXPECT_EQ(a.pose().covariance, b.pose().covariance);
  }

  ImuHistory imu_ = imu_at_rest(1000);
  HypothesisSet hypotheses_{settings(), kMounting};
  OutputPredictor predictor_{kMounting, settings().gates};
  std::vector<Measurement> pending_;
};

TEST_F(Prediction, FusesTheReadingsThatWait) {
  pending_ = {bearing(at_ms(20), 0.01), range(at_ms(30), 4.1)};
  NeighborTrack expected = hypotheses_.leader().heaviest();
  for (const Measurement& z : pending_) {
    expected.advance_to(z.stamp, imu_, imu_);
    ASSERT_EQ(fuse(expected, z).verdict, Verdict::kFused);
  }
  expected.advance_to(at_ms(30), imu_, imu_);

  expect_same(predictor_.predict(at_ms(30), hypotheses_, readings()), expected);
}

TEST_F(Prediction, LeavesOutReadingsAfterItsInstant) {
  pending_ = {range(at_ms(80), 4.3)};
  const NeighborTrack without = fresh(50);
  pending_.clear();

  expect_same(without, fresh(50));
}

TEST_F(Prediction, DoesNotChangeTheHypotheses) {
  pending_ = {bearing(at_ms(20))};

  static_cast<void>(predictor_.predict(at_ms(100), hypotheses_, readings()));

  EXPECT_EQ(hypotheses_.stamp(), at_ms(0));
  EXPECT_EQ(hypotheses_.leader().heaviest().last(MeasurementKind::kBearing), kNever);
}

TEST_F(Prediction, ContinuesAsIfItStartedAnew) {
  for (int ms = 5; ms < 400; ms += 5) pending_.push_back(bearing(at_ms(ms), 0.001));

  for (int ms = 20; ms <= 400; ms += 20) {
    const NeighborTrack track = predictor_.predict(at_ms(ms), hypotheses_, readings());
    EXPECT_EQ(track.last(MeasurementKind::kBearing), fresh(ms).last(MeasurementKind::kBearing));
    EXPECT_LT(pose_difference(track.pose().pose, fresh(ms).pose().pose).norm(), 1e-6) << ms;
  }
}

TEST_F(Prediction, CountsALateReadingOnceItIsInvalidated) {
  static_cast<void>(predictor_.predict(at_ms(100), hypotheses_, readings()));
  pending_ = {range(at_ms(40), 4.3)};

  const NeighborTrack without = predictor_.predict(at_ms(100), hypotheses_, readings());
  predictor_.invalidate_from(at_ms(40));
  const NeighborTrack with = predictor_.predict(at_ms(100), hypotheses_, readings());

  EXPECT_EQ(without.last(MeasurementKind::kRange), kNever);
  EXPECT_EQ(with.last(MeasurementKind::kRange), at_ms(40));
  expect_same(with, fresh(100));
}

TEST_F(Prediction, FollowsANewLeader) {
  static_cast<void>(predictor_.predict(at_ms(100), hypotheses_, readings()));
  const Pose other{{0.0, 3.0, 0.0}, Eigen::Quaterniond::Identity()};
  ASSERT_TRUE(hypotheses_.initialize(at_ms(50), GraphPose{RobotId{2}, {other, covariance()}}));

  expect_same(predictor_.predict(at_ms(100), hypotheses_, readings()), fresh(100));
}

}  // namespace
}  // namespace crepes::output_predictor_test
