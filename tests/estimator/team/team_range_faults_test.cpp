/// The filter of a team in which a robot's ranges are too long.
#include <gtest/gtest.h>

#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "estimator/team/team_filter.hpp"
#include "tests/estimator/team/fault_of.hpp"
#include "tests/support/simulated_team.hpp"
#include "tests/support/team_solution.hpp"

namespace crepes::team_range_faults_test {
namespace {

using test::fault_of;
using test::find;
using test::kIntervalSeconds;
using test::kProbation;
using test::kSelf;
using test::nees_of;
using test::position_nees_of;
using test::SimulatedTeam;
using test::solution_after;

// As when its pair's filter believed it from the beginning: its place fits its own ranges, and all
// others' contradict. Nobody else is drawn along.
TEST(TeamFaults, ARobotThatStartsByItsOwnLongRangesMovesNobody) {
  constexpr RobotId kLiar{4};
  int beyond = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SimulatedTeam team(seed);
    team.damage = [&](TeamInterval& interval) {
      const std::vector<TeamRange> by_one = interval.ranges;
      for (TeamRange range : by_one) {
        std::swap(range.observer, range.neighbor);
        interval.ranges.push_back(range);
      }
      for (TeamRange& range : interval.ranges)
        if (range.observer == kLiar) range.reading.range_m += 1.0;
      for (RelativePoseEdge& edge : interval.edges)
        if (edge.from == kLiar || edge.to == kLiar)
          edge.T_from_to.pose.p += edge.T_from_to.pose.p.normalized();
    };
    TeamFilter filter;
    for (double t = 0.0; t < 8.0; t += kIntervalSeconds) {
      const bool are_alone = t < kProbation;
      team.sees = [=](RobotId i, RobotId j) {
        return !are_alone || std::set{i, j} == std::set{kSelf, kLiar};
      };
      const TeamSolution solution = filter.step(team.next());
      for (const RobotId robot : {RobotId{2}, RobotId{3}}) {
        const TeamPose* pose = find(solution, robot);
        if (pose != nullptr && position_nees_of(*pose, team.truth(robot)) > 35.0) ++beyond;
      }
    }
  }
  EXPECT_EQ(beyond, 0);
}

// All ranges to and from a robot that this one trusts before it knows anybody else. So the robots
// that come later contradict the scale, until most pairs do: then the filter begins anew.
TEST(TeamFaults, AnAntennaDelayThatCameFirstIsOutvoted) {
  constexpr RobotId kLiar{4};
  constexpr double kSettled = 6.0;  // s
  int poses = 0;
  int beyond = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SimulatedTeam team(seed);
    team.damage = [&](TeamInterval& interval) {
      for (TeamRange& range : interval.ranges)
        if (range.observer == kLiar || range.neighbor == kLiar) range.reading.range_m += 1.0;
      for (RelativePoseEdge& edge : interval.edges)
        if (edge.from == kLiar || edge.to == kLiar)
          edge.T_from_to.pose.p += edge.T_from_to.pose.p.normalized();
    };
    TeamFilter filter;
    for (double t = 0.0; t < 12.0; t += kIntervalSeconds) {
      const bool are_alone = t < kProbation;
      team.sees = [=](RobotId i, RobotId j) {
        return !are_alone || std::set{i, j} == std::set{kSelf, kLiar};
      };
      const TeamSolution solution = filter.step(team.next());
      for (const RobotId robot : {RobotId{2}, RobotId{3}}) {
        const TeamPose* pose = find(solution, robot);
        if (pose == nullptr || t < kSettled) continue;
        ++poses;
        if (position_nees_of(*pose, team.truth(robot)) > 35.0) ++beyond;
      }
    }
  }
  EXPECT_GT(poses, 1000);
  EXPECT_EQ(beyond, 0);
}

// A trusted robot's module, or this robot's own, reads too long: a robot that was away is trusted
// again all the same.
TEST(TeamFaults, FalseRangesOfATrustedRobotKeepNobodyOnProbation) {
  static constexpr RobotId kAway{4};
  for (const RobotId liar : {RobotId{2}, kSelf}) {
    SCOPED_TRACE(liar.value);
    SimulatedTeam team(3, 6);
    double t = 0.0;
    const auto is_away = [](RobotId a, RobotId b) { return a == kAway || b == kAway; };
    team.damage = [&](TeamInterval& interval) {
      const std::vector<TeamRange> by_one = interval.ranges;
      for (TeamRange range : by_one) {
        std::swap(range.observer, range.neighbor);
        interval.ranges.push_back(range);
      }
      for (TeamRange& range : interval.ranges)
        if (t > 4.0 && range.observer == liar) range.reading.range_m += 1.0;
      if (t < 6.0 || t > 8.0) return;
      std::erase_if(interval.members, [](const TeamMember& m) { return m.robot == kAway; });
      std::erase_if(interval.bearings,
                    [&](const TeamBearing& z) { return is_away(z.observer, z.bearing.neighbor); });
      std::erase_if(interval.ranges,
                    [&](const TeamRange& z) { return is_away(z.observer, z.neighbor); });
      std::erase_if(interval.edges,
                    [&](const RelativePoseEdge& edge) { return is_away(edge.from, edge.to); });
    };
    TeamFilter filter;
    int trusted = 0;
    for (; t < 18.0; t += kIntervalSeconds) {
      const TeamSolution solution = filter.step(team.next());
      for (const RobotCalibration& robot : solution.calibrations)
        if (t > 12.0 && robot.robot == kAway && robot.is_trusted) ++trusted;
    }
    EXPECT_GT(trusted, 55);
  }
}

// They are too long from a moment on, and a crowded mesh carries few of them.
TEST(TeamFaults, NamesRangesThatAreTooLongHoweverRareTheyAre) {
  constexpr RobotId kLiar{4};
  for (const int every : {1, 2, 3}) {
    SimulatedTeam team(1, 5);
    TeamFilter filter;
    int intervals = 0;
    bool lies = false;
    team.damage = [&](TeamInterval& interval) {
      for (TeamRange& r : interval.ranges) {
        if (r.neighbor == kLiar) std::swap(r.observer, r.neighbor);
        if (lies && r.observer == kLiar) r.reading.range_m += 1.0;
      }
      if (++intervals % every != 0) interval.ranges.clear();
    };
    EXPECT_EQ(fault_of(solution_after(team, filter, 15.0), kLiar), nullptr) << every;
    lies = true;
    const TeamFault* first = nullptr;
    TeamSolution solution;
    for (int i = 0; i < 40 && first == nullptr; ++i) {
      solution = filter.step(team.next());
      first = fault_of(solution, kLiar);
    }
    ASSERT_NE(first, nullptr) << every;
    EXPECT_EQ(first->kind, TeamFault::Kind::kRanges) << every;
    EXPECT_NEAR(first->size, 1.0, 0.15) << every;
  }
}

TEST(TeamFaults, NamesRangesThatAreTooLong) {
  constexpr RobotId kLiar{4};
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SimulatedTeam team(seed);
    team.damage = [&](TeamInterval& interval) {
      for (TeamRange& r : interval.ranges)
        if (r.neighbor == kLiar) std::swap(r.observer, r.neighbor);
      for (TeamRange& r : interval.ranges)
        if (r.observer == kLiar) r.reading.range_m += 1.0;
    };
    TeamFilter filter;
    const TeamSolution solution = solution_after(team, filter, 5.0);
    const TeamFault* fault = fault_of(solution, kLiar);
    ASSERT_NE(fault, nullptr) << seed;
    EXPECT_EQ(fault->kind, TeamFault::Kind::kRanges);
    EXPECT_NEAR(fault->size, 1.0, 0.15) << seed;
    for (const TeamPose& pose : solution.poses)
      EXPECT_LT(nees_of(pose, team.truth(pose.neighbor)), 30.0) << seed;
  }
}

}  // namespace
}  // namespace crepes::team_range_faults_test
