#include "estimator/swarm/pose_publisher.hpp"

#include <gtest/gtest.h>

#include "tests/support/estimator_pair.hpp"
#include "tests/support/resting_pair.hpp"

namespace crepes::pose_publisher_test {
namespace {

using namespace std::chrono_literals;
using namespace test::resting;

constexpr RobotId kNeighbor{2};

/// A neighbor at rest that the team knows, without a filter of its own.
class TeamPublisher : public testing::Test {
 protected:
  TeamPublisher() { self_.imu = neighbor_.imu = imu_at_rest(1000); }

  /// The team's pose at `ms`, seen by anybody at `sighted_ms`.
  void add(int ms, int sighted_ms, double sigma_m = 0.05, bool needs_confirmation = false,
           bool was_knocked = false) {
    TeamPose pose{.neighbor = kNeighbor, .T_B_N = kTruth};
    pose.covariance.diagonal().head<3>().setConstant(sigma_m * sigma_m);
    pose.covariance.diagonal().segment<6>(3).setConstant(1e-4);
    pose.last_sighting = at_ms(sighted_ms);
    pose.needs_confirmation = needs_confirmation;
    pose.was_knocked = was_knocked;
    publisher_.add_team_pose({at_ms(ms), pose, {}, {}});
  }
  [[nodiscard]] std::optional<NeighborPose> at(int now_ms, const LastContact& last = {}) {
    publisher_.clear();
    publisher_.update_team(at_ms(now_ms), self_, neighbor_, last);
    return publisher_.published();
  }

  RobotState self_;
  RobotState neighbor_;
  PosePublisher publisher_{kNeighbor, kMounting, settings()};
};

TEST_F(TeamPublisher, CarriesTheTeamsPoseToTheNewestSample) {
  add(900, 900);
  const auto pose = at(1000);
  ASSERT_TRUE(pose);
  EXPECT_EQ(pose->neighbor, kNeighbor);
  EXPECT_EQ(pose->stamp, at_ms(1000));
  EXPECT_EQ(pose->published, at_ms(1000));
  EXPECT_LT((pose->T_B_N.pose.p - kTruth.p).norm(), 1e-6);
  EXPECT_GT(pose->T_B_N.covariance(0, 0), 0.05 * 0.05);
  EXPECT_TRUE(pose->sources.graph);
}

// Who saw it decides the mode: this robot, anybody, or nobody.
TEST_F(TeamPublisher, TheModeSaysWhoSawItOfLate) {
  const LastContact seen{.seen = at_ms(950)};
  const LastContact long_ago{.seen = at_ms(100)};
  add(900, 900);
  EXPECT_EQ(at(1000, seen)->mode, PoseMode::kDirect);
  EXPECT_EQ(at(1000, long_ago)->mode, PoseMode::kGraph);
  add(900, 200);
  EXPECT_EQ(at(1000, long_ago)->mode, PoseMode::kPredicted);
  EXPECT_NEAR(at(1000, long_ago)->age_s, 0.8, 1e-9);
}

TEST_F(TeamPublisher, AStateIsAtMostTwentyMillisecondsOld) {
  add(900, 900);
  const auto pose = at(1200);
  ASSERT_TRUE(pose);
  EXPECT_EQ(pose->stamp, at_ms(1180));
}

TEST_F(TeamPublisher, AnOldSolutionIsNotCarriedOn) {
  add(100, 100);
  EXPECT_FALSE(at(1000));
  add(300, 300);
  EXPECT_TRUE(at(1000));
}

TEST_F(TeamPublisher, ASolutionOfTheFutureWaits) {
  add(1100, 1100);
  EXPECT_FALSE(at(1000));
}

TEST_F(TeamPublisher, DoesNotPublishWhatIsTooUncertain) {
  add(900, 900, 1.5);
  EXPECT_FALSE(at(1000));
}

TEST_F(TeamPublisher, APoseThatNeedsAWitnessIsNotPublishedAlone) {
  add(900, 900, 0.05, true);
  EXPECT_FALSE(at(1000));
}

TEST_F(TeamPublisher, PublishesNothingWithoutASolution) { EXPECT_FALSE(at(1000)); }

/// With a filter of its own that knows the same place, or another one.
class TeamAndFilter : public TeamPublisher {
 protected:
  /// The latest range came at `ranged_ms`, if ever; the filter has used none.
  [[nodiscard]] std::optional<NeighborPose> with_filter_at(const Pose& place,
                                                           std::optional<int> ranged_ms = {},
                                                           int now_ms = 1000) {
    HypothesisSet hypotheses(settings(), kMounting);
    const GraphPose start{kNeighbor, {place, covariance()}};
    EXPECT_TRUE(hypotheses.initialize(at_ms(now_ms - 20), start));
    ReadingIntake intake(kNeighbor, settings());
    if (ranged_ms) {
      UwbRange refused{.stamp = at_ms(*ranged_ms), .neighbor = kNeighbor, .range_m = -1.0};
      EXPECT_FALSE(intake.add_range(refused, MeasurementKind::kRange));
    }
    publisher_.clear();
    publisher_.update(at_ms(now_ms), self_, neighbor_, hypotheses, intake);
    if (!publisher_.pose()) return std::nullopt;
    publisher_.update_team(at_ms(now_ms), self_, neighbor_, {.seen = at_ms(now_ms - 10)});
    return publisher_.published();
  }
  /// The team's pose and samples until `now_ms`.
  void go_on_until(int now_ms) {
    self_.imu = neighbor_.imu = imu_at_rest(now_ms);
    add(now_ms - 100, now_ms - 100);
  }
  [[nodiscard]] static double sigma_m(const NeighborPose& pose) {
    return std::sqrt(pose.T_B_N.covariance(0, 0));
  }
};

TEST_F(TeamAndFilter, TheTeamsPoseReplacesAFiltersThatAgrees) {
  add(900, 900);
  const auto pose = with_filter_at({{kDistance + 0.1, 0.0, 0.0}, Eigen::Quaterniond::Identity()});
  ASSERT_TRUE(pose);
  EXPECT_LT((pose->T_B_N.pose.p - kTruth.p).norm(), 1e-6);
  EXPECT_LT(std::sqrt(pose->T_B_N.covariance(0, 0)), 0.1);
}

TEST_F(TeamAndFilter, AFilterThatAgreesIsAWitness) {
  add(900, 900, 0.05, true);
  const auto pose = with_filter_at({{kDistance + 0.1, 0.0, 0.0}, Eigen::Quaterniond::Identity()});
  ASSERT_TRUE(pose);
  EXPECT_LT((pose->T_B_N.pose.p - kTruth.p).norm(), 1e-6);
}

// As it takes a knocked camera to be calibrated.
TEST_F(TeamAndFilter, AFilterThatIsNoWitnessContradictsNothing) {
  const Pose elsewhere{{kDistance + 0.8, 0.0, 0.0}, Eigen::Quaterniond::Identity()};
  for (int ms = 1000; ms <= 2500; ms += 100) {
    self_.imu = neighbor_.imu = imu_at_rest(ms);
    add(ms - 100, ms - 100, 0.05, false, true);
    const auto pose = with_filter_at(elsewhere, ms - 100, ms);
    ASSERT_TRUE(pose) << ms;
    EXPECT_LT((pose->T_B_N.pose.p - kTruth.p).norm(), 1e-6) << ms;
    EXPECT_LT(sigma_m(*pose), 0.1) << ms;
    EXPECT_FALSE(publisher_.take_restart()) << ms;
  }
}

// Without ranges a filter's distance is by the IMUs alone. While many are refused, either of the
// two may be wrong.
TEST_F(TeamAndFilter, OneThatContradictsTheTeamLosesIfRangesAreRare) {
  add(900, 900);
  const Pose elsewhere{{kDistance + 0.8, 0.0, 0.0}, Eigen::Quaterniond::Identity()};
  for (const std::optional<int> ranged_ms : {std::optional<int>{}, std::optional(700)}) {
    const auto pose = with_filter_at(elsewhere, ranged_ms);
    ASSERT_TRUE(pose);
    EXPECT_LT((pose->T_B_N.pose.p - kTruth.p).norm(), 1e-6);
  }
  const auto doubtful = with_filter_at(elsewhere, 900);
  ASSERT_TRUE(doubtful);
  EXPECT_LT((doubtful->T_B_N.pose.p - elsewhere.p).norm(), 1e-6);
  EXPECT_GT(std::sqrt(doubtful->T_B_N.covariance(0, 0)), 0.8);
}

// Until it is there again, the team's pose may be the wrong one.
TEST_F(TeamAndFilter, AFilterThatTheTeamContradictsForASecondStartsAnew) {
  const Pose elsewhere{{kDistance + 0.8, 0.0, 0.0}, Eigen::Quaterniond::Identity()};
  for (int ms = 1000; ms <= 2000; ms += 100) {
    go_on_until(ms);
    EXPECT_TRUE(with_filter_at(elsewhere, ms - 100, ms)) << ms;
    EXPECT_EQ(publisher_.take_restart(), ms == 2000) << ms;
  }
  go_on_until(2200);
  const auto alone = at(2200);
  ASSERT_TRUE(alone);
  EXPECT_LT((alone->T_B_N.pose.p - kTruth.p).norm(), 1e-6);
  EXPECT_GT(sigma_m(*alone), 0.8);
  EXPECT_FALSE(publisher_.take_restart());

  go_on_until(2500);
  ASSERT_TRUE(with_filter_at(kTruth, 2400, 2500));
  EXPECT_LT(sigma_m(*publisher_.published()), 0.1);
  go_on_until(2600);
  ASSERT_TRUE(at(2600));
  EXPECT_LT(sigma_m(*publisher_.published()), 0.1);
}

// A second is one in which they were compared all the time.
TEST_F(TeamAndFilter, AFilterThatIsContradictedNowAndThenGoesOn) {
  const Pose elsewhere{{kDistance + 0.8, 0.0, 0.0}, Eigen::Quaterniond::Identity()};
  for (const int ms : {1000, 2500, 2900, 4200}) {
    go_on_until(ms);
    EXPECT_TRUE(with_filter_at(elsewhere, ms - 100, ms)) << ms;
    EXPECT_FALSE(publisher_.take_restart()) << ms;
  }
}

// Out of sight it contradicts nothing, and a later contradiction is another one.
TEST_F(TeamAndFilter, AFilterThatIsContradictedNowAndLongAgoGoesOn) {
  const Pose elsewhere{{kDistance + 0.8, 0.0, 0.0}, Eigen::Quaterniond::Identity()};
  for (const int ms : {1000, 1900, 4200, 5100}) {
    go_on_until(ms);
    EXPECT_TRUE(with_filter_at(elsewhere, ms - 100, ms)) << ms;
    EXPECT_FALSE(publisher_.take_restart()) << ms;
  }
}

TEST_F(TeamAndFilter, AFilterThatAgreesNowAndThenGoesOn) {
  const Pose elsewhere{{kDistance + 0.8, 0.0, 0.0}, Eigen::Quaterniond::Identity()};
  for (int ms = 1000; ms <= 3000; ms += 100) {
    go_on_until(ms);
    EXPECT_TRUE(with_filter_at(ms % 500 == 0 ? kTruth : elsewhere, ms - 100, ms)) << ms;
    EXPECT_FALSE(publisher_.take_restart()) << ms;
  }
}

// A team pose without a witness does not make a filter doubtful either.
TEST_F(TeamAndFilter, AFilterThatContradictsAnUnwitnessedTeamPoseIsPublished) {
  add(900, 900, 0.05, true);
  const Pose elsewhere{{kDistance + 3.0, 0.0, 0.0}, Eigen::Quaterniond::Identity()};
  const auto pose = with_filter_at(elsewhere);
  ASSERT_TRUE(pose);
  EXPECT_LT((pose->T_B_N.pose.p - elsewhere.p).norm(), 1e-6);
  EXPECT_LT(std::sqrt(pose->T_B_N.covariance(0, 0)), 0.5);
}

// What a team's pose differed by is a vector in the world.
TEST_F(TeamAndFilter, WhatMakesATeamsPoseDoubtfulTurnsWithTheRobot) {
  const Eigen::Vector3d difference(0.8, 0.0, 0.0);
  for (int ms = 1000; ms <= 2000; ms += 100) {
    go_on_until(ms);
    EXPECT_TRUE(with_filter_at({kTruth.p + difference, kTruth.q}, ms - 100, ms)) << ms;
    EXPECT_EQ(publisher_.take_restart(), ms == 2000) << ms;
  }
  self_.imu = imu_that_turns(2000, 2800);
  neighbor_.imu = imu_at_rest(2800);
  for (int ms = 2020; ms <= 2800; ms += 20) {
    add(ms - 100, ms - 100);
    ASSERT_TRUE(at(ms)) << ms;
  }

  const Eigen::Matrix3d P = publisher_.published()->T_B_N.covariance.topLeftCorner<3, 3>();
  const Eigen::Vector3d along = after_turn(difference, 800).normalized();
  EXPECT_GT(std::sqrt(along.dot(P * along)), 0.8);
  EXPECT_LT(std::sqrt(along.unitOrthogonal().dot(P * along.unitOrthogonal())), 0.2);
}

// Its step is a vector in the world, too, and knows the distance worse than the direction.
TEST(GraphCorrection, TurnsWithTheRobot) {
  RobotState self{.imu = imu_at_rest(1000), .tilt = {}};
  RobotState neighbor{.imu = imu_at_rest(1300), .tilt = {}};
  HypothesisSet hypotheses(settings(), kMounting);
  ASSERT_TRUE(hypotheses.initialize(at_ms(1000), sighting()));
  ReadingIntake intake(kNeighbor, settings());
  PosePublisher publisher(kNeighbor, kMounting, settings());
  publisher.update(at_ms(1000), self, neighbor, hypotheses, intake);
  ASSERT_TRUE(publisher.pose());
  GraphPose graph{kNeighbor, publisher.pose()->T_B_N};
  graph.T_B_N.pose.p.x() += 0.3;
  graph.T_B_N.covariance = 1e-4 * Matrix6d::Identity();
  graph.T_B_N.covariance(0, 0) = 0.01;
  publisher.add_graph_correction(at_ms(1000), graph);

  self.imu = imu_that_turns(1000, 1300);
  for (int ms = 1020; ms <= 1300; ms += 20) {
    publisher.clear();
    publisher.update(at_ms(ms), self, neighbor, hypotheses, intake);
  }

  const auto pose = publisher.published();
  ASSERT_TRUE(pose);
  EXPECT_TRUE(pose->sources.graph);
  EXPECT_LT((pose->T_B_N.pose.p - after_turn(graph.T_B_N.pose.p, 300)).norm(), 0.02);
  const Eigen::Vector3d line = after_turn(Eigen::Vector3d::UnitX(), 300);
  const Eigen::Matrix3d P = pose->T_B_N.covariance.topLeftCorner<3, 3>();
  EXPECT_NEAR(line.dot(P * line), 0.01, 1e-4);
}

// A graph that agrees with the filter corrects nothing, however long its answer takes.
TEST(GraphCorrection, IsThatOfThePoseOfItsOwnInstant) {
  for (const Duration delay : {0ms, 20ms, 60ms}) {
    test::EstimatorPair with(1);
    test::EstimatorPair without(1);
    for (test::EstimatorPair* pair : {&with, &without}) pair->run_for(4s);
    for (int i = 0; i < 20; ++i) {
      const NeighborPose then = without.latest()->pose;
      for (test::EstimatorPair* pair : {&with, &without}) pair->run_for(delay);
      with.solve(
          GraphSolution{then.stamp, {{test::EstimatorPair::kOther, then.T_B_N, then.v_B_N}}});
      for (test::EstimatorPair* pair : {&with, &without}) pair->run_for(100ms - delay);
      const Vector6d step =
          pose_difference(with.latest()->pose.T_B_N.pose, without.latest()->pose.T_B_N.pose);
      EXPECT_LT(step.norm(), 1e-9) << delay / 1ms << " ms";
      EXPECT_TRUE(with.latest()->pose.sources.graph);
    }
  }
}

}  // namespace
}  // namespace crepes::pose_publisher_test
