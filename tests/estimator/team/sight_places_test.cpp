/// A robot without ranges is placed by the bearings of others, and by its own.
#include "estimator/team/belief/sight_places.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>

#include "estimator/team/peer_view.hpp"
#include "estimator/team/team_filter.hpp"
#include "tests/support/simulated_team.hpp"
#include "tests/support/team_solution.hpp"

namespace crepes::sight_places_test {
namespace {

using test::kIntervalSeconds;
using test::kSelf;
using test::SimulatedTeam;

constexpr RobotId kSilent{4};
constexpr RobotId kOther{2};
constexpr int kTeams = 8;
constexpr double kSixDof5Sigma = 46.0;  // of six degrees of freedom as likely as 5 sigma of three

/// A robot that measures no ranges, and to which nobody measures any.
void remove_ranges_of(RobotId silent, TeamInterval& interval) {
  std::erase_if(interval.ranges, [silent](const TeamRange& z) {
    return z.observer == silent || z.neighbor == silent;
  });
  std::erase_if(interval.edges, [silent](const RelativePoseEdge& edge) {
    return edge.from == silent || edge.to == silent;
  });
}

TEST(PlacesBySight, AreAsCertainAsTheySay) {
  for (std::uint64_t seed = 1; seed <= kTeams; ++seed) {
    SimulatedTeam team(seed, 4);
    team.damage = [](TeamInterval& interval) { remove_ranges_of(kSilent, interval); };
    TeamFilter filter;
    std::optional<TeamPlace> first;
    for (double t = 0.0; t < 6.0; t += kIntervalSeconds) {
      const TeamInterval interval = team.next();
      const TeamSolution solution = filter.step(interval);
      const auto silent = std::ranges::find(solution.poses, kSilent, &TeamPose::neighbor);
      if (!first && filter.belief().robots.contains(kSilent))
        first = TeamPlace::of(filter.belief(), kSilent);
      if (t < 2.5) continue;
      ASSERT_NE(silent, solution.poses.end()) << seed << " at " << t;
      const Pose truth = team.truth(kSilent);
      EXPECT_LT(test::nees_of(*silent, truth), kSixDof5Sigma) << seed << " at " << t;
      EXPECT_LT(test::error_of(*silent, truth).head<3>().norm(), 0.15) << seed << " at " << t;
    }
    ASSERT_TRUE(first) << seed;
    const Eigen::Matrix3d position = first->covariance.topLeftCorner<3, 3>();
    EXPECT_LT(position.trace(), 0.25) << seed;
  }
}

TEST(PlacesBySight, NeedTwoRobotsThatSeeItAndTwoThatItSees) {
  const auto is_placed = [&](int robots, const std::function<bool(RobotId, RobotId)>& sees) {
    SimulatedTeam team(5, robots);
    team.sees = sees;
    team.damage = [](TeamInterval& interval) { remove_ranges_of(kSilent, interval); };
    TeamFilter filter;
    for (double t = 0.0; t < 4.0; t += kIntervalSeconds) (void)filter.step(team.next());
    return filter.belief().robots.contains(kSilent);
  };
  EXPECT_TRUE(is_placed(4, [](RobotId, RobotId) { return true; }));
  EXPECT_FALSE(is_placed(4, [](RobotId i, RobotId j) { return j != kSilent || i == kOther; }));
  EXPECT_FALSE(is_placed(4, [](RobotId i, RobotId j) { return i != kSilent || j == kOther; }));
}

// This robot itself has no ranges: it goes on from how the peers see it.
TEST(PlacesBySight, TellARobotWithoutRangesOfItsTeam) {
  for (std::uint64_t seed = 1; seed <= kTeams; ++seed) {
    SimulatedTeam team(seed, 4);
    team.damage = [](TeamInterval& interval) { remove_ranges_of(kSelf, interval); };
    PeerView view;
    TeamFilter filter;
    for (double t = 0.0; t < 8.0; t += kIntervalSeconds) {
      const TeamInterval interval = team.next();
      auto seen = view.step(interval, filter.belief());
      const TeamSolution solution = filter.step(interval);
      const bool is_new = seen && seen->belief;
      if (is_new) filter.replace(*std::move(seen->belief));
      if (t < 4.0) continue;
      EXPECT_FALSE(seen) << seed << " at " << t;
      ASSERT_EQ(solution.poses.size(), 3U) << seed << " at " << t;
      for (const TeamPose& pose : solution.poses) {
        const Pose truth = team.truth(pose.neighbor);
        EXPECT_LT(test::nees_of(pose, truth), kSixDof5Sigma) << seed << " at " << t;
        EXPECT_LT(test::error_of(pose, truth).head<3>().norm(), 0.15) << seed << " at " << t;
      }
    }
  }
}

}  // namespace
}  // namespace crepes::sight_places_test
