/// The filter of a team with a robot that nobody has ever seen.
#include <gtest/gtest.h>

#include <cstdint>
#include <functional>

#include "estimator/team/team_filter.hpp"
#include "tests/support/simulated_team.hpp"
#include "tests/support/team_solution.hpp"

namespace crepes::unseen_robots_test {
namespace {

using test::error_of;
using test::find;
using test::kIntervalSeconds;
using test::nees_of;
using test::SimulatedTeam;

constexpr RobotId kUnseen{4};
constexpr int kTeams = 8;
constexpr double kSixDof5Sigma = 46.0;  // of six degrees of freedom as likely as 5 sigma of three

/// What is found of it in so many teams.
struct Found {
  int teams = 0;
  int poses = 0;
  int beyond = 0;
};

Found found(int robots, double seconds, const std::function<void(SimulatedTeam&)>& alter) {
  Found found;
  for (std::uint64_t seed = 1; seed <= kTeams; ++seed) {
    SimulatedTeam team(seed, robots);
    TeamFilter filter;
    team.hovers = true;
    team.sees = [](RobotId i, RobotId j) { return i != kUnseen && j != kUnseen; };
    alter(team);
    int poses = 0;
    for (double t = 0.0; t < seconds; t += kIntervalSeconds) {
      const TeamSolution solution = filter.step(team.next());
      const TeamPose* pose = find(solution, kUnseen);
      if (pose == nullptr) continue;
      ++poses;
      if (nees_of(*pose, team.truth(kUnseen)) > kSixDof5Sigma) ++found.beyond;
    }
    found.poses += poses;
    found.teams += poses > 0 ? 1 : 0;
  }
  return found;
}

/// Changes all ranges between it and another robot.
void change_ranges(SimulatedTeam& team, const std::function<void(TeamRange&, RobotId)>& change) {
  team.damage = [change](TeamInterval& interval) {
    for (TeamRange& z : interval.ranges) {
      if (z.observer == kUnseen) change(z, z.neighbor);
      if (z.neighbor == kUnseen) change(z, z.observer);
    }
  };
}

TEST(UnseenRobots, AreFoundByTheirRanges) {
  const Found all = found(7, 12.0, [](SimulatedTeam&) {});
  EXPECT_GE(all.teams, kTeams - 1);
  EXPECT_EQ(all.beyond, 0) << "of " << all.poses;
}

TEST(UnseenRobots, AreNotFoundByFewerThanFour) {
  const Found all = found(4, 8.0, [](SimulatedTeam&) {});
  EXPECT_EQ(all.poses, 0);
}

// As through a wall.
TEST(UnseenRobots, AreNotFoundElsewhereByARangeThatIsTooLong) {
  const Found all = found(7, 12.0, [](SimulatedTeam& team) {
    change_ranges(team, [](TeamRange& z, RobotId beacon) {
      if (beacon == RobotId{2}) z.reading.range_m += 1.0;
    });
  });
  EXPECT_EQ(all.beyond, 0) << "of " << all.poses;
}

TEST(UnseenRobots, AreEstimatedLikeAllOthersOnceTheyAreSeen) {
  SimulatedTeam team(3, 7);
  TeamFilter filter;
  team.hovers = true;
  team.sees = [](RobotId i, RobotId j) { return i != kUnseen && j != kUnseen; };
  ASSERT_NE(find(test::solution_after(team, filter, 12.0), kUnseen), nullptr);
  team.sees = [](RobotId, RobotId) { return true; };
  const TeamSolution seen = test::solution_after(team, filter, 3.0);
  const TeamPose* pose = find(seen, kUnseen);
  ASSERT_NE(pose, nullptr);
  EXPECT_LT(error_of(*pose, team.truth(kUnseen)).head<3>().norm(), 0.1);
  EXPECT_LT(nees_of(*pose, team.truth(kUnseen)), kSixDof5Sigma);
}

}  // namespace
}  // namespace crepes::unseen_robots_test
