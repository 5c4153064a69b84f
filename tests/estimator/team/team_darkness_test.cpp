/// The filter of a team in which nobody sees somebody, or somebody nobody.
#include <gtest/gtest.h>

#include <cstdint>

#include "estimator/team/team_filter.hpp"
#include "tests/support/simulated_team.hpp"
#include "tests/support/team_solution.hpp"

namespace crepes::team_darkness_test {
namespace {

using test::find;
using test::kIntervalSeconds;
using test::kSelf;
using test::position_nees_of;
using test::SimulatedTeam;
using test::solution_after;

/// What becomes of a robot that nobody sees any more, and that sees nobody.
struct InTheDark {
  int located = 0;  ///< teams in which its place is known to half a meter in the end
  int poses = 0;
  int beyond = 0;  ///< five sigma, of all robots
};

InTheDark in_the_dark(RobotId dark, double seconds, bool has_ranges, bool hovers = true) {
  InTheDark result;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SimulatedTeam team(seed, 6);
    team.hovers = hovers;
    TeamFilter filter;
    static_cast<void>(solution_after(team, filter, 4.0));
    team.sees = [dark](RobotId i, RobotId j) { return i != dark && j != dark; };
    if (!has_ranges) {
      team.damage = [dark](TeamInterval& interval) {
        std::erase_if(interval.ranges, [dark](const TeamRange& range) {
          return range.observer == dark || range.neighbor == dark;
        });
      };
    }
    TeamSolution solution;
    for (double t = 0.0; t < seconds; t += kIntervalSeconds) {
      solution = filter.step(team.next());
      for (const TeamPose& pose : solution.poses) {
        ++result.poses;
        if (position_nees_of(pose, team.truth(pose.neighbor)) > 35.0) ++result.beyond;
      }
    }
    const TeamPose* pose = find(solution, dark == kSelf ? RobotId{2} : dark);
    if (pose == nullptr) continue;
    const Eigen::Matrix3d covariance = pose->covariance.topLeftCorner<3, 3>();
    if (covariance.trace() < 0.25) ++result.located;
  }
  return result;
}

TEST(TeamDarkness, RangesLocateARobotThatNobodySees) {
  const InTheDark with = in_the_dark(RobotId{4}, 30.0, true);
  EXPECT_EQ(with.beyond, 0) << "of " << with.poses;
  EXPECT_GE(with.located, 5);
  const InTheDark without = in_the_dark(RobotId{4}, 30.0, false);
  EXPECT_EQ(without.beyond, 0) << "of " << without.poses;
  EXPECT_EQ(without.located, 0);
}

// Of robots that fall freely: hovering, this robot loses what is up, and with it the others'
// places.
TEST(TeamDarkness, RangesLocateTheTeamForARobotThatSeesNobody) {
  const InTheDark with = in_the_dark(kSelf, 30.0, true, false);
  EXPECT_EQ(with.beyond, 0) << "of " << with.poses;
  EXPECT_GE(with.located, 5);
}

}  // namespace
}  // namespace crepes::team_darkness_test
