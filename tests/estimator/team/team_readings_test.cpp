#include "estimator/team/readings/team_readings.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "estimator/team/readings/reading_rows.hpp"
#include "tests/support/simulated_belief.hpp"

namespace crepes::team_readings_test {
namespace {

using test::SimulatedTeam;

constexpr RobotId kObserver{4};
constexpr RobotId kNeighbor{2};

/// A team in which one robot sees a mirror image beside another robot, or instead of it.
class TeamReadingsTest : public testing::Test {
 protected:
  void mirror(bool is_robot_seen) {
    team_.damage = [is_robot_seen](TeamInterval& interval) {
      std::vector<TeamBearing> images;
      for (TeamBearing& b : interval.bearings) {
        if (b.observer != kObserver || b.bearing.neighbor != kNeighbor) continue;
        TeamBearing image = b;
        image.bearing.u_B = so3_exp(0.2 * Eigen::Vector3d::UnitZ()) * b.bearing.u_B;
        if (is_robot_seen)
          images.push_back(image);
        else
          b = image;
      }
      // In each frame, the image comes first.
      interval.bearings.insert(interval.bearings.begin(), images.begin(), images.end());
    };
  }

  /// What remains of the sight, if the observer's orientation is known so well.
  std::vector<const Bearing*> gated(double orientation_sigma_rad) {
    const test::TrueMotions before = test::motions_of(team_);
    interval_ = team_.next();
    belief_ = test::true_belief(before, interval_);
    belief_.P.diagonal()
        .segment<3>(belief_.robots.at(kObserver).motion_index + 6)
        .setConstant(orientation_sigma_rad * orientation_sigma_rad);
    const TeamTrajectories paths = belief_.trajectories(interval_);
    TeamReadings readings = TeamReadings::of(interval_, belief_, TeamReadings::Stage::kTrusted);
    const TeamInstant instant(belief_, paths, readings.time_s(interval_));
    std::vector<TeamResidual> residuals;
    gate({interval_, paths, instant, belief_}, belief_, readings, residuals);
    for (const TeamResidual& residual : residuals)
      if (residual.observer == kObserver && residual.neighbor == kNeighbor &&
          residual.kind == TeamResidual::Kind::kBearing)
        residual_ = residual;
    for (const Sight& sight : readings.sights)
      if (sight.observer == kObserver && sight.neighbor == kNeighbor) return sight.bearings;
    return {};
  }

  [[nodiscard]] Agreement agreement() const {
    return belief_.robots.at(kObserver).cameras.front().agreement.at(kNeighbor);
  }

  SimulatedTeam team_{1};
  TeamInterval interval_;
  TeamBelief belief_;
  TeamResidual residual_;
};

constexpr double kKnown = 0.02;    // rad
constexpr double kUnknown = 0.35;  // rad

TEST_F(TeamReadingsTest, OfARobotAndItsMirrorImageTheLikelierIsFused) {
  mirror(true);
  EXPECT_EQ(gated(kKnown).size(), 4U);
  EXPECT_LT(
      residual_.residual[0] * residual_.residual[0] + residual_.residual[1] * residual_.residual[1],
      0.02 * 0.02);
  EXPECT_EQ(residual_.fused, 4);
}

TEST_F(TeamReadingsTest, TheImageBesideTheRobotDoesNotSpeakAgainstTheCamera) {
  mirror(true);
  (void)gated(kKnown);
  EXPECT_EQ(agreement().fused, 4.0);
  EXPECT_EQ(agreement().gated, 0.0);
}

// Their mean, halfway between the two, was fused before.
TEST_F(TeamReadingsTest, NeitherIsFusedWhereEitherMayBeTheRobot) {
  mirror(true);
  EXPECT_TRUE(gated(kUnknown).empty());
  EXPECT_EQ(residual_.refused, 4);
  EXPECT_FALSE(belief_.robots.at(kObserver).cameras.front().agreement.contains(kNeighbor));
}

TEST_F(TeamReadingsTest, AnImageAloneIsRefusedAndSpeaksAgainstTheCamera) {
  mirror(false);
  EXPECT_TRUE(gated(kKnown).empty());
  EXPECT_EQ(agreement().gated, 4.0);
}

// It may be far off and yet within the gate, where the pair's distance is known to a meter only.
TEST(TeamRanges, OneThatIsMoreLikelyFalseIsRefusedAndSpeaksAgainstItsPair) {
  SimulatedTeam team(1);
  const test::TrueMotions before = test::motions_of(team);
  for (const double error_m : {0.5, 3.0}) {
    team.damage = [&](TeamInterval& interval) {
      for (TeamRange& z : interval.ranges) z.reading.range_m += error_m;
    };
    const TeamInterval interval = SimulatedTeam(team).next();
    TeamBelief belief = test::true_belief(before, interval);
    belief.P.diagonal().segment<3>(belief.robots.at(kNeighbor).motion_index).setConstant(1.0);
    const TeamTrajectories paths = belief.trajectories(interval);
    TeamReadings readings = TeamReadings::of(interval, belief, TeamReadings::Stage::kTrusted);
    const TeamInstant instant(belief, paths, readings.time_s(interval));
    std::vector<TeamResidual> residuals;
    gate({interval, paths, instant, belief}, belief, readings, residuals);
    const auto& by_observer = belief.ranges.at(ordered(kObserver, kNeighbor)).agreement;
    ASSERT_FALSE(by_observer.empty());
    for (const auto& [observer, agreement] : by_observer) {
      EXPECT_EQ(agreement.fused > 0.0, error_m < 1.0) << error_m;
      EXPECT_EQ(agreement.gated > 0.0, error_m > 1.0) << error_m;
    }
  }
}

TEST(TeamRows, ARangeIsAsLikelyToBeTrueInEveryIteration) {
  SimulatedTeam team(7, 4);
  const test::TrueMotions before = test::motions_of(team);
  TeamInterval interval = team.next();
  interval.bearings.clear();
  std::erase_if(interval.ranges, [](const TeamRange& range) {
    return range.observer != test::kSelf || range.neighbor != kNeighbor;
  });
  for (TeamRange& range : interval.ranges) range.reading.range_m += 0.35;
  TeamBelief belief = test::true_belief(before, interval);
  const int place = belief.robots.at(kNeighbor).motion_index;
  const Eigen::Vector3d line = belief.robots.at(kNeighbor).motion.p_F.normalized();
  belief.P.block<3, 3>(place, place) += 0.04 * line * line.transpose();
  const TeamReadings readings = TeamReadings::of(interval, belief, TeamReadings::Stage::kTrusted);
  const auto row_after = [&](double step_m) {
    TeamBelief moved = belief;
    Eigen::VectorXd dx = Eigen::VectorXd::Zero(belief.P.rows());
    dx.segment<3>(place) = step_m * line;
    moved.inject(dx);
    const TeamTrajectories paths = moved.trajectories(interval);
    const TeamInstant instant(moved, paths, readings.time_s(interval));
    return linearized({interval, paths, instant, moved}, readings, instant.image_of(dx)).at(0);
  };

  const TeamRow first = row_after(0.0);
  const TeamRow second = row_after(0.3);

  EXPECT_GT(first.residual.x(), 0.35) << "it may be false, so that its variance is larger";
  EXPECT_NEAR(second.variance, first.variance, 0.02 * first.variance);
  EXPECT_NEAR(second.residual.x() + 0.3, first.residual.x(), 0.02);
}

}  // namespace
}  // namespace crepes::team_readings_test
