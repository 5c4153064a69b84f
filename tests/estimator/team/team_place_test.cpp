#include "estimator/team/belief/team_place.hpp"

#include <gtest/gtest.h>

#include "tests/support/random_geometry.hpp"
#include "tests/support/simulated_belief.hpp"

namespace crepes::team_place_test {
namespace {

using namespace std::chrono_literals;
using Errors = Eigen::Matrix<double, 9, 1>;

TeamPlace moved(const TeamPlace& place, const Errors& errors) {
  TeamPlace other = place;
  Vector6d of_pose;
  of_pose << errors.head<3>(), errors.tail<3>();
  other.T_S_N = perturbed(place.T_S_N, of_pose);
  other.v_S_N += errors.segment<3>(3);
  return other;
}

// By draws of all errors: those of the robot that estimates, and of its estimate.
TEST(TeamPlace, AChainHasTheErrorsOfAllItsLinks) {
  test::RandomGeometry random(3);
  constexpr int kDraws = 500;
  TeamPlace here{.T_S_N = random.pose(), .v_S_N = random.vector(0.5)};
  here.covariance = random.covariance<9>(0.02);
  const GaussianPose step{random.pose(), random.covariance<6>(0.02)};
  const Eigen::Vector3d v_step = random.vector(0.5);
  const TeamPlace there = here.beyond(RobotId{2}, step, v_step, {});
  double nees = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    const TeamPlace true_here = moved(here, random.draw<9>(here.covariance));
    const GaussianPose true_step{perturbed(step.pose, random.draw<6>(step.covariance)),
                                 Matrix6d::Zero()};
    const TeamPlace truth = true_here.beyond(
        RobotId{2}, true_step, v_step + random.vector(NeighborEstimate::kSpeedSigma), Timestamp{});
    const Vector6d of_pose = pose_difference(there.T_S_N, truth.T_S_N);
    Errors e;
    e << of_pose.head<3>(), truth.v_S_N - there.v_S_N, of_pose.tail<3>();
    nees += e.dot(there.covariance.llt().solve(e)) / kDraws;
  }
  EXPECT_NEAR(nees, 9.0, 0.8);  // four sigmas of the mean
}

TEST(TeamPlace, WasSeenWhenTheOldestLinkWas) {
  test::SimulatedTeam team(1);
  const test::TrueMotions motions = test::motions_of(team);
  TeamBelief belief = test::true_belief(motions, team.next());
  belief.robots.at(RobotId{2}).last_sighting = belief.stamp - 3s;
  const GaussianPose step{Pose{}, 1e-4 * Matrix6d::Identity()};
  const auto seen = [&](RobotId via, Timestamp estimated) {
    return TeamPlace::of(belief, via).beyond(via, step, {}, estimated).last_sighting;
  };
  EXPECT_EQ(seen(test::kSelf, belief.stamp - 200ms), belief.stamp - 200ms);
  EXPECT_EQ(seen(RobotId{2}, belief.stamp - 200ms), belief.stamp - 3s);
}

// Who is connected with a robot in the dark is as old as the ranges that locate that one.
TEST(TeamPlace, BeyondARobotThatRangesLocateIsAsNewAsTheyAre) {
  test::SimulatedTeam team(1);
  const test::TrueMotions motions = test::motions_of(team);
  const TeamInterval interval = team.next();
  TeamBelief belief = test::true_belief(motions, interval);
  TeamRobot& dark = belief.robots.at(RobotId{2});
  dark.last_sighting = kNever;
  dark.last_fix = belief.stamp - 100ms;
  const GaussianPose step{Pose{}, 1e-4 * Matrix6d::Identity()};
  const auto seen = [&](Timestamp estimated) {
    return TeamPlace::of(belief, RobotId{2})
        .beyond(RobotId{2}, step, {}, estimated)
        .pose(RobotId{9}, belief, interval.settings.priors)
        .last_sighting;
  };
  EXPECT_EQ(seen(belief.stamp), belief.stamp - 100ms);
  EXPECT_EQ(seen(belief.stamp - 200ms), belief.stamp - 200ms);
}

TEST(TeamPlace, APoseOfAStrangerHasTheBiasesOfAnyImu) {
  test::SimulatedTeam team(1);
  const test::TrueMotions motions = test::motions_of(team);
  const TeamInterval interval = team.next();
  const TeamBelief belief = test::true_belief(motions, interval);
  const Priors& priors = interval.settings.priors;
  const TeamPose pose = TeamPlace::of(belief, RobotId{3}).pose(RobotId{9}, belief, priors);
  EXPECT_EQ(pose.neighbor, RobotId{9});
  EXPECT_EQ(pose.pose_covariance(), belief.pose(RobotId{3}).covariance);
  EXPECT_NEAR(pose.covariance(15, 15), std::pow(priors.gyro_bias_radps, 2), 1e-12);
  EXPECT_GT(pose.covariance(18, 18), std::pow(priors.accel_bias_mps2, 2) - 1e-12);
}

}  // namespace
}  // namespace crepes::team_place_test
