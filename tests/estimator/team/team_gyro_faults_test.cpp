/// The filter of a team in which a robot's gyroscope is false.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "estimator/team/team_filter.hpp"
#include "tests/estimator/team/fault_of.hpp"
#include "tests/support/simulated_team.hpp"
#include "tests/support/team_solution.hpp"

namespace crepes::team_gyro_faults_test {
namespace {

using test::camera_sigma_rad;
using test::error_of;
using test::fault_of;
using test::find;
using test::kIntervalSeconds;
using test::kProbation;
using test::kSelf;
using test::nees_of;
using test::position_nees_of;
using test::SimulatedTeam;
using test::solution_after;

constexpr double kRefused_s = 1.0;  // after a gyroscope was last found false

/// Its gyroscope reads nearly twice its rate.
void scale_gyro(TeamInterval& interval, RobotId robot) {
  for (TeamMember& member : interval.members)
    if (member.robot == robot)
      for (ImuMean& mean : member.imu) mean.gyro_radps *= 1.9;
}

TEST(TeamFaults, NamesAFalseGyroscopeAndIsWithoutThatRobotAsLongAsItLasts) {
  constexpr RobotId kLiar{4};
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SimulatedTeam team(seed);
    TeamFilter filter;
    static_cast<void>(solution_after(team, filter, 3.0));
    team.damage = [&](TeamInterval& interval) { scale_gyro(interval, kLiar); };
    TeamSolution solution;
    bool is_named = false;
    int absent = 0;
    for (double t = 0.0; t < 3.0; t += kIntervalSeconds) {
      solution = filter.step(team.next());
      const TeamFault* fault = fault_of(solution, kLiar);
      is_named = is_named || (fault != nullptr && fault->kind == TeamFault::Kind::kGyro);
      for (const RobotId robot : {RobotId{2}, RobotId{3}}) {
        const TeamPose* pose = find(solution, robot);
        if (pose == nullptr) {
          ++absent;  // placed again by the pair's filter, whose pose is published
          continue;
        }
        EXPECT_LT(nees_of(*pose, team.truth(robot)), 30.0) << seed << " at " << t;
      }
    }
    EXPECT_TRUE(is_named) << seed;
    EXPECT_LE(absent, 4) << seed;  // both of them, each time that the liar was trusted
    team.damage = [](TeamInterval&) {};
    solution = solution_after(team, filter, 3.0);
    for (const TeamFault& fault : solution.faults)
      ADD_FAILURE() << seed << ": robot " << fault.robot.value << ", kind "
                    << static_cast<int>(fault.kind) << ", " << fault.size;
    const TeamPose* pose = find(solution, kLiar);
    ASSERT_NE(pose, nullptr) << seed;
    EXPECT_LT(nees_of(*pose, team.truth(kLiar)), 30.0) << seed;
  }
}

// Everything that it knows is relative to itself, so it begins anew.
TEST(TeamFaults, RecoversFromItsOwnFalseGyroscope) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SimulatedTeam team(seed);
    TeamFilter filter;
    static_cast<void>(solution_after(team, filter, 3.0));
    team.damage = [](TeamInterval& interval) { scale_gyro(interval, kSelf); };
    TeamSolution solution = solution_after(team, filter, 2.0);
    const TeamFault* fault = fault_of(solution, kSelf);
    ASSERT_NE(fault, nullptr) << seed;
    EXPECT_EQ(fault->kind, TeamFault::Kind::kGyro);
    team.damage = [](TeamInterval&) {};
    solution = solution_after(team, filter, 3.0);
    for (const TeamFault& found : solution.faults)
      ADD_FAILURE() << seed << ": robot " << found.robot.value << ", kind "
                    << static_cast<int>(found.kind) << ", " << found.size;
    ASSERT_EQ(solution.poses.size(), 3U) << seed;
    for (const TeamPose& pose : solution.poses) {
      EXPECT_LT(nees_of(pose, team.truth(pose.neighbor)), 30.0) << seed;
      EXPECT_LT(error_of(pose, team.truth(pose.neighbor)).head<3>().norm(), 0.15) << seed;
    }
  }
}

// Whoever had the false gyroscope.
TEST(TeamFaults, AFalseGyroscopeCostsNobodyWhatWasLearnedOfHisCamera) {
  for (const RobotId liar : {kSelf, RobotId{4}}) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      SimulatedTeam team(seed);
      TeamFilter filter;
      const TeamSolution before = solution_after(team, filter, 15.0);
      team.damage = [&](TeamInterval& interval) { scale_gyro(interval, liar); };
      static_cast<void>(solution_after(team, filter, 1.0));
      team.damage = [](TeamInterval&) {};
      // After its refusal the robot itself starts anew, and the others are on probation.
      const TeamSolution after = solution_after(team, filter, kRefused_s + kProbation + 0.2);
      for (const RobotId robot : {RobotId{2}, RobotId{3}}) {
        EXPECT_LT(camera_sigma_rad(after, robot), 1.1 * camera_sigma_rad(before, robot))
            << "liar " << liar.value << ", seed " << seed;
        const TeamPose* pose = find(after, robot);
        ASSERT_NE(pose, nullptr) << "liar " << liar.value << ", seed " << seed;
        EXPECT_LT(nees_of(*pose, team.truth(robot)), 30.0)
            << "liar " << liar.value << ", seed " << seed;
      }
    }
  }
}

// Again and again its robot is trusted, found false, and leaves. The others go on learning.
TEST(TeamFaults, AGyroscopeThatIsFalseNowAndThenForAMinuteCostsTheOthersLittle) {
  constexpr RobotId kLiar{4};
  constexpr double kMinute = 60.0;
  for (const double period_s : {1.4, 2.0, 3.0, 5.0}) {
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
      const auto label = testing::Message() << "every " << period_s << " s, seed " << seed;
      SimulatedTeam team(seed);
      TeamFilter filter;
      team.damage = [&](TeamInterval& interval) {
        const double since_s = to_seconds(interval.from.time_since_epoch());
        if (std::fmod(since_s, period_s) < 0.4) scale_gyro(interval, kLiar);
      };
      TeamSolution solution = solution_after(team, filter, 5.0);
      int absent = 0;
      for (double t = 0.0; t < kMinute; t += kIntervalSeconds) {
        solution = filter.step(team.next());
        for (const RobotId robot : {RobotId{2}, RobotId{3}}) {
          const TeamPose* pose = find(solution, robot);
          if (pose == nullptr) {
            ++absent;
          } else {
            EXPECT_LT(position_nees_of(*pose, team.truth(robot)), 35.0) << label << " at " << t;
          }
        }
      }
      EXPECT_LE(absent, 8) << label;  // of 1,200: both of them, at most four times

      SimulatedTeam others(seed);
      others.sees = [=](RobotId i, RobotId j) { return i != kLiar && j != kLiar; };
      TeamFilter unharmed;
      const TeamSolution alone = solution_after(others, unharmed, 5.0 + kMinute);
      for (const RobotId robot : {RobotId{2}, RobotId{3}})
        EXPECT_LT(camera_sigma_rad(solution, robot), 1.1 * camera_sigma_rad(alone, robot)) << label;
    }
  }
}

}  // namespace
}  // namespace crepes::team_gyro_faults_test
