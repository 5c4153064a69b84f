/// The filter of a team that is larger than what is estimated jointly.
#include <gtest/gtest.h>

#include <cstdint>
#include <set>

#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"
#include "estimator/team/team_filter.hpp"
#include "tests/support/simulated_team.hpp"
#include "tests/support/team_solution.hpp"

namespace crepes::team_size_test {
namespace {

using test::error_of;
using test::find;
using test::kIntervalSeconds;
using test::kSelf;
using test::nees_of;
using test::SimulatedTeam;
using test::solution_after;

TEST(TeamSize, LocatesRobotsBeyondItsSizeThroughTheOthers) {
  static constexpr RobotId kHidden{6};
  SimulatedTeam team(1, 6);
  team.sees = [](RobotId a, RobotId b) { return std::set{a, b} != std::set{kSelf, kHidden}; };
  team.damage = [](TeamInterval& interval) {
    interval.settings.max_robots = 4;
    // The hidden robot's estimates are the worst, so that it is not one of the four.
    for (RelativePoseEdge& edge : interval.edges)
      if (edge.from == kHidden || edge.to == kHidden) edge.T_from_to.covariance *= 1.2;
  };
  TeamFilter filter;
  const TeamSolution solution = solution_after(team, filter, 4.0);
  ASSERT_NE(find(solution, kHidden), nullptr);
  EXPECT_LT(nees_of(*find(solution, kHidden), team.truth(kHidden)), 30.0);
  EXPECT_LT(error_of(*find(solution, kHidden), team.truth(kHidden)).head<3>().norm(), 0.5);
  EXPECT_EQ(solution.poses.size(), 4U);  // three of the filter, and the hidden one
}

/// Robots that the filter estimates itself, of a team that this robot sees.
std::set<RobotId> estimated_jointly(const TeamSolution& solution) {
  std::set<RobotId> robots;
  for (const TeamPose& pose : solution.poses) robots.insert(pose.neighbor);
  return robots;
}

// Robot 4 comes early and then loses all but one of the others. Robot 5 sees everybody.
TEST(TeamSize, ABetterConnectedRobotTakesThePlaceOfAPoorlyConnectedOne) {
  static constexpr RobotId kPoor{4};
  static constexpr RobotId kRich{5};
  SimulatedTeam team(1, 5);
  team.damage = [](TeamInterval& interval) { interval.settings.max_robots = 4; };
  team.sees = [](RobotId a, RobotId b) { return a != kRich && b != kRich; };
  TeamFilter filter;
  EXPECT_TRUE(estimated_jointly(solution_after(team, filter, 3.0)).contains(kPoor));
  team.sees = [](RobotId a, RobotId b) {
    const std::set both{a, b};
    return !both.contains(kPoor) || both.contains(RobotId{2});
  };
  static_cast<void>(solution_after(team, filter, 8.0));
  for (double t = 0.0; t < 4.0; t += kIntervalSeconds) {
    const TeamSolution solution = filter.step(team.next());
    for (const RobotId robot : {RobotId{2}, RobotId{3}, kPoor, kRich}) {
      const TeamPose* pose = find(solution, robot);  // of the poor one, through the others
      ASSERT_NE(pose, nullptr) << robot.value;
      EXPECT_LT(nees_of(*pose, team.truth(robot)), 30.0) << robot.value;
    }
  }
}

TEST(TeamSize, EquallyConnectedRobotsKeepTheirPlaces) {
  SimulatedTeam team(1, 6);
  team.damage = [](TeamInterval& interval) { interval.settings.max_robots = 4; };
  TeamFilter filter;
  const auto first = estimated_jointly(solution_after(team, filter, 3.0));
  EXPECT_EQ(first.size(), 3U);
  for (double t = 0.0; t < 6.0; t += kIntervalSeconds)
    ASSERT_EQ(estimated_jointly(filter.step(team.next())), first) << t;
}

TEST(TeamSize, ASmallerSizeHoldsFromTheNextIntervalOn) {
  SimulatedTeam team(1, 6);
  std::size_t size = 6;
  team.damage = [&](TeamInterval& interval) { interval.settings.max_robots = size; };
  TeamFilter filter;
  static_cast<void>(solution_after(team, filter, 3.0));
  EXPECT_EQ(filter.belief().robots.size(), 6U);
  size = 3;
  static_cast<void>(filter.step(team.next()));
  EXPECT_LE(filter.belief().robots.size(), 3U);
  static_cast<void>(solution_after(team, filter, 3.0));
  EXPECT_EQ(filter.belief().robots.size(), 3U);
}

// Robot 5 sees everybody, but no estimate of it can be used.
TEST(TeamSize, NobodyLeavesForARobotThatCannotBePlaced) {
  static constexpr RobotId kPoor{4};
  static constexpr RobotId kRich{5};
  SimulatedTeam team(1, 5);
  team.damage = [](TeamInterval& interval) {
    interval.settings.max_robots = 4;
    for (RelativePoseEdge& edge : interval.edges)
      if (edge.from == kRich || edge.to == kRich) edge.T_from_to.covariance.setZero();
  };
  team.sees = [](RobotId a, RobotId b) { return a != kRich && b != kRich; };
  TeamFilter filter;
  static_cast<void>(solution_after(team, filter, 3.0));
  team.sees = [](RobotId a, RobotId b) {
    const std::set both{a, b};
    return !both.contains(kPoor) || both.contains(RobotId{2});
  };
  for (double t = 0.0; t < 8.0; t += kIntervalSeconds) {
    static_cast<void>(filter.step(team.next()));
    ASSERT_TRUE(filter.belief().robots.contains(kPoor)) << t;
  }
}

// A chain of estimates has the errors of the others' cameras, too, which the filter has used.
TEST(TeamSize, RobotsBeyondItsSizeAreHonestOverSeeds) {
  static constexpr RobotId kHidden{6};
  constexpr int kSeeds = 40;
  double nees = 0.0;
  int beyond = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SimulatedTeam team(seed, 6);
    team.sees = [](RobotId a, RobotId b) { return std::set{a, b} != std::set{kSelf, kHidden}; };
    team.damage = [&](TeamInterval& interval) {
      interval.settings.max_robots = 4;
      for (RelativePoseEdge& edge : interval.edges) {
        // By a camera that is misaligned; its estimate knows how well it is calibrated.
        const Pose turn{Eigen::Vector3d::Zero(), so3_exp(team.misalignment(edge.from))};
        edge.T_from_to.pose = turn * edge.T_from_to.pose;
        const Eigen::Matrix3d of_turn = std::pow(radians(0.17), 2) * Eigen::Matrix3d::Identity();
        const Eigen::Matrix3d arm = hat(edge.T_from_to.pose.p);
        edge.T_from_to.covariance.topLeftCorner<3, 3>() += arm * of_turn * arm.transpose();
        edge.T_from_to.covariance.bottomRightCorner<3, 3>() += of_turn;
        if (edge.from == kHidden || edge.to == kHidden) edge.T_from_to.covariance *= 1.2;
      }
    };
    TeamFilter filter;
    const TeamSolution solution = solution_after(team, filter, 3.0);
    const TeamPose* pose = find(solution, kHidden);
    ASSERT_NE(pose, nullptr) << seed;
    const double one = nees_of(*pose, team.truth(kHidden));
    nees += one / kSeeds;
    beyond += one > 22.5 ? 1 : 0;
    EXPECT_LT(to_seconds(solution.stamp - pose->last_sighting), 0.3) << seed;
  }
  EXPECT_LT(nees, 7.2);
  EXPECT_LE(beyond, 1);
}

// Its tiny covariance makes its estimate the most certain chain, until it is named.
TEST(TeamSize, ARobotBeyondIsNotPlacedByWhoIsKnownToLie) {
  static constexpr RobotId kLiar{2};
  static constexpr RobotId kHonest{3};
  static constexpr RobotId kHidden{6};
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SimulatedTeam team(seed, 6);
    team.sees = [](RobotId a, RobotId b) {
      if (a != kHidden && b != kHidden) return true;
      const RobotId other = a == kHidden ? b : a;
      return other == kLiar || other == kHonest;
    };
    team.damage = [](TeamInterval& interval) {
      interval.settings.max_robots = 5;
      for (RelativePoseEdge& edge : interval.edges) {
        if (edge.from != kLiar) continue;
        edge.T_from_to.pose.p.x() += 2.0;
        edge.T_from_to.covariance = 1e-6 * Matrix6d::Identity();
      }
    };
    TeamFilter filter;
    const TeamSolution solution = solution_after(team, filter, 5.0);
    const TeamPose* pose = find(solution, kHidden);
    ASSERT_NE(pose, nullptr) << seed;
    EXPECT_LT(nees_of(*pose, team.truth(kHidden)), 22.5) << seed;
  }
}

}  // namespace
}  // namespace crepes::team_size_test
