#include "estimator/team/team_filter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <vector>

#include "tests/support/simulated_team.hpp"
#include "tests/support/team_solution.hpp"

namespace crepes::team_filter_test {
namespace {

using test::error_of;
using test::find;
using test::kIntervalSeconds;
using test::kProbation;
using test::kSelf;
using test::nees_of;
using test::position_nees_of;
using test::SimulatedTeam;
using test::solution_after;

TEST(TeamFilter, ErrorsAgreeWithTheirCovarianceOverSeeds) {
  double nees = 0.0;
  int count = 0;
  int beyond = 0;
  for (std::uint64_t seed = 1; seed <= 80; ++seed) {
    SimulatedTeam team(seed);
    TeamFilter filter;
    for (const double seconds : {2.0, 4.0}) {
      const TeamSolution solution = solution_after(team, filter, seconds);
      ASSERT_EQ(solution.poses.size(), 3U);
      for (const TeamPose& pose : solution.poses) {
        const double one = nees_of(pose, team.truth(pose.neighbor));
        nees += one;
        ++count;
        beyond += one > 22.5 ? 1 : 0;  // 99.9 % of chi-square with 6 degrees of freedom
      }
    }
  }
  EXPECT_GT(nees / count, 4.8);
  EXPECT_LT(nees / count, 7.2);
  EXPECT_LE(beyond, 3) << "of " << count;
}

// Antenna delays have a mean. A pair's biases that were independent would average it away, and with
// it the doubt about the team's size.
TEST(TeamFilter, ModulesThatAllMeasureTooLongStayWithinTheCovariance) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SimulatedTeam team(seed, 9);
    team.damage = [](TeamInterval& interval) {
      for (TeamRange& range : interval.ranges) range.reading.range_m += 0.06;
    };
    TeamFilter filter;
    const TeamSolution solution = solution_after(team, filter, 4.0);
    ASSERT_EQ(solution.poses.size(), 8U);
    for (const TeamPose& pose : solution.poses)
      EXPECT_LT(nees_of(pose, team.truth(pose.neighbor)), 25.0) << "seed " << seed;
  }
}

// Bearings at rest say nothing of the scale, and what ranges say of it errs with their biases. It
// is somewhat too certain: 2.2 on the mean, where 1 would be right.
TEST(TeamFilter, AtRestItsScaleErrsLittleMoreThanItSays) {
  constexpr int kSeeds = 20;
  double sum = 0.0;
  double most = 0.0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SimulatedTeam team(seed);
    team.rests = true;
    team.bias_ranges(0.2);
    TeamFilter filter;
    for (int i = 0; i < 300; ++i) static_cast<void>(filter.step(team.next()));
    const TeamBelief& belief = filter.belief();
    Eigen::VectorXd by_states = Eigen::VectorXd::Zero(belief.P.rows());
    double error = 0.0;
    ASSERT_EQ(belief.robots.size(), 4U) << seed;
    for (const auto& [id, robot] : belief.robots) {
      if (robot.motion_index < 0) continue;
      const Eigen::Vector3d p = team.truth(id).p;
      by_states.segment<3>(robot.motion_index) = p;
      error += p.dot(robot.motion.p_F - p);
    }
    const double ratio2 = error * error / by_states.dot(belief.P * by_states);
    sum += ratio2;
    most = std::max(most, ratio2);
  }
  EXPECT_LT(sum / kSeeds, 3.0);
  EXPECT_LT(most, 16.0);
}

// Behind an obstacle, ranges grow longer by as much as the gate accepts, and say so. One in ten
// poses is beyond 5 sigma if each counts as an independent one.
TEST(TeamFilter, RangesThatAreLongTogetherLeaveItHonest) {
  static constexpr RobotId kBehind{3};
  static constexpr double kLonger = 0.2;  // m
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SimulatedTeam team(seed);
    double t_s = 0.0;
    team.damage = [&](TeamInterval& interval) {
      for (TeamRange& z : interval.ranges) {
        if (z.observer != kBehind && z.neighbor != kBehind) continue;
        z.reading.shared_m = kLonger * std::clamp(t_s - 2.0, 0.0, 1.0);
        z.reading.range_m += z.reading.shared_m;
      }
      t_s += kIntervalSeconds;
    };
    TeamFilter filter;
    (void)solution_after(team, filter, kProbation);
    while (t_s < 6.0) {
      for (const TeamPose& pose : filter.step(team.next()).poses)
        EXPECT_LT(position_nees_of(pose, team.truth(pose.neighbor)), 35.0) << seed << ' ' << t_s;
    }
  }
}

TEST(TeamFilter, ReachesARobotThatOnlyOthersSee) {
  static constexpr RobotId kHidden{3};
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SimulatedTeam team(seed);
    team.sees = [](RobotId a, RobotId b) { return std::set{a, b} != std::set{kSelf, kHidden}; };
    TeamFilter filter;
    const TeamSolution solution = solution_after(team, filter, 5.0);
    const TeamPose* pose = find(solution, kHidden);
    ASSERT_NE(pose, nullptr);
    EXPECT_LT(error_of(*pose, team.truth(kHidden)).head<3>().norm(), 0.1);
    EXPECT_LT(nees_of(*pose, team.truth(kHidden)), 30.0);
  }
}

// Of what each robot measured: the gate's residuals, one row a camera and neighbor, a pair's ranges
// and a gyroscope.
TEST(TeamFilter, ResidualsAreAsLargeAsTheirCovarianceSays) {
  std::map<TeamResidual::Kind, double> nis;
  std::map<TeamResidual::Kind, double> dimension;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SimulatedTeam team(seed);
    TeamFilter filter;
    static_cast<void>(solution_after(team, filter, 3.0));
    for (double t = 0.0; t < 3.0; t += kIntervalSeconds) {
      const TeamSolution solution = filter.step(team.next());
      EXPECT_EQ(solution.residuals.size(), 12U + 6U + 4U);
      for (const TeamResidual& residual : solution.residuals) {
        nis[residual.kind] += residual.nis;
        dimension[residual.kind] += residual.dimension;
      }
    }
  }
  // An honest filter has 1. Bearings of an interval are weighed as one of constant noise, although
  // their noise here changes from one to the next: 0.79.
  const double of_bearings =
      nis[TeamResidual::Kind::kBearing] / dimension[TeamResidual::Kind::kBearing];
  EXPECT_GT(of_bearings, 0.7);
  EXPECT_LT(of_bearings, 1.1);
  EXPECT_NEAR(nis[TeamResidual::Kind::kRange] / dimension[TeamResidual::Kind::kRange], 1.0, 0.15);
  EXPECT_LT(nis[TeamResidual::Kind::kGyro] / dimension[TeamResidual::Kind::kGyro], 1.2);
}

// Their sum over seeds is as large as their sigmas say.
TEST(TeamFilter, CalibrationsAreAsGoodAsTheySay) {
  double nees = 0.0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SimulatedTeam team(seed);
    TeamFilter filter;
    const TeamSolution solution = solution_after(team, filter, 5.0);
    ASSERT_EQ(solution.calibrations.size(), 4U);
    for (const RobotCalibration& robot : solution.calibrations) {
      EXPECT_TRUE(robot.is_trusted);
      ASSERT_EQ(robot.cameras.size(), 1U);
      const CameraMisalignment& camera = robot.cameras.front();
      const Eigen::Vector3d error = camera.rotation - team.misalignment(robot.robot);
      nees += error.dot(camera.covariance.llt().solve(error));
      ++count;
      EXPECT_EQ(camera.state, CameraMisalignment::State::kCalibrated);
      EXPECT_LT(robot.antenna_delay_sigma_m, 0.05);
    }
  }
  // Three degrees of freedom. The prior allows more than these cameras are turned by: 1.8.
  EXPECT_LT(nees / count, 3.3);
  EXPECT_GT(nees / count, 1.2);
}

TEST(TeamFilter, IgnoresEstimatesThatAreNone) {
  const double kNone = std::numeric_limits<double>::quiet_NaN();
  SimulatedTeam team(1);
  int count = 0;
  team.damage = [&](TeamInterval& interval) {
    for (RelativePoseEdge& edge : interval.edges) {
      if (edge.from != RobotId{4} && edge.to != RobotId{4}) continue;
      switch (++count % 4) {
        case 0:
          edge.T_from_to.pose.p.x() = kNone;
          break;
        case 1:
          edge.T_from_to.covariance(0, 0) = kNone;
          break;
        case 2:
          edge.T_from_to.covariance(0, 1) = edge.T_from_to.covariance(1, 0) = 10.0;
          break;
        default:
          edge.v_from_to.z() = std::numeric_limits<double>::infinity();
      }
    }
  };
  TeamFilter filter;
  const TeamSolution solution = solution_after(team, filter, 3.0);
  ASSERT_EQ(solution.poses.size(), 2U);
  for (const TeamPose& pose : solution.poses)
    EXPECT_LT(nees_of(pose, team.truth(pose.neighbor)), 30.0);
}

// A configuration that claims to know the cameras' directions exactly is no reason to restart.
TEST(TeamFilter, WorksWithoutMisalignmentToEstimate) {
  SimulatedTeam team(1);
  team.damage = [](TeamInterval& interval) { interval.settings.priors.misalignment_rad = 0.0; };
  TeamFilter filter;
  static_cast<void>(solution_after(team, filter, kProbation));
  for (double t = 0.0; t < 3.0; t += kIntervalSeconds)
    EXPECT_EQ(filter.step(team.next()).poses.size(), 3U);
}

TEST(TeamFilter, ForgetsARobotWithoutImuAndFindsItAgain) {
  SimulatedTeam team(1);
  TeamFilter filter;
  EXPECT_NE(find(solution_after(team, filter, 2.0), RobotId{2}), nullptr);
  team.damage = [](TeamInterval& interval) {
    std::erase_if(interval.members, [](const TeamMember& m) { return m.robot == RobotId{2}; });
  };
  const TeamSolution without = filter.step(team.next());
  EXPECT_EQ(find(without, RobotId{2}), nullptr);
  EXPECT_NE(find(without, RobotId{3}), nullptr);
  team.damage = [](TeamInterval&) {};
  const TeamSolution again = solution_after(team, filter, kProbation);
  ASSERT_NE(find(again, RobotId{2}), nullptr);
  EXPECT_LT(nees_of(*find(again, RobotId{2}), team.truth(RobotId{2})), 30.0);
}

TEST(TeamFilter, KnowsNobodyWithoutThisRobotsImu) {
  SimulatedTeam team(1);
  TeamFilter filter;
  EXPECT_EQ(solution_after(team, filter, kProbation).poses.size(), 3U);
  team.damage = [](TeamInterval& interval) {
    std::erase_if(interval.members, [](const TeamMember& m) { return m.robot == kSelf; });
  };
  EXPECT_TRUE(filter.step(team.next()).poses.empty());
  team.damage = [](TeamInterval&) {};
  EXPECT_EQ(solution_after(team, filter, kProbation).poses.size(), 3U);
}

// A robot that names another place of its camera with every bearing costs no memory.
TEST(TeamFilter, TakesNoMoreThanAFewCamerasOfARobot) {
  SimulatedTeam team(2);
  double place_m = 0.0;
  team.damage = [&](TeamInterval& interval) {
    for (TeamBearing& b : interval.bearings) {
      if (b.observer == RobotId{4}) b.bearing.p_B_C.x() = place_m += 1e-6;
    }
  };
  TeamFilter filter;
  const TeamSolution solution = solution_after(team, filter, 3.0);
  ASSERT_NE(find(solution, RobotId{2}), nullptr);
  EXPECT_LT(nees_of(*find(solution, RobotId{2}), team.truth(RobotId{2})), 30.0);
}

TEST(TeamFilter, BeginsAnewAfterAGap) {
  SimulatedTeam team(2);
  TeamFilter filter;
  EXPECT_EQ(solution_after(team, filter, kProbation).poses.size(), 3U);
  static_cast<void>(team.next());
  EXPECT_TRUE(filter.step(team.next()).poses.empty());
  const TeamSolution after = solution_after(team, filter, kProbation);
  ASSERT_EQ(after.poses.size(), 3U);
  for (const TeamPose& pose : after.poses)
    EXPECT_LT(nees_of(pose, team.truth(pose.neighbor)), 30.0);
}

TEST(TeamFilter, TheSameIntervalsGiveTheSameBits) {
  std::vector<TeamSolution> solutions;
  for (int run = 0; run < 2; ++run) {
    SimulatedTeam team(3);
    TeamFilter filter;
    solutions.push_back(solution_after(team, filter, 2.0));
  }
  ASSERT_EQ(solutions[0].poses.size(), solutions[1].poses.size());
  for (std::size_t i = 0; i < solutions[0].poses.size(); ++i) {
    EXPECT_TRUE(solutions[0].poses[i].T_B_N == solutions[1].poses[i].T_B_N);
    EXPECT_EQ(solutions[0].poses[i].covariance, solutions[1].poses[i].covariance);
  }
}

}  // namespace
}  // namespace crepes::team_filter_test
