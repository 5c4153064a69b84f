#include "estimator/team/team_filter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>

#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"
#include "tests/support/simulated_team.hpp"

namespace crepes {
namespace {

using test::kIntervalSeconds;
using test::kSelf;
using test::SimulatedTeam;

constexpr double kProbation = 1.5;  // s; longer than robots are on probation, and some intervals

const TeamPose* find(const TeamSolution& solution, RobotId robot) {
  const auto found = std::ranges::find(solution.poses, robot, &TeamPose::neighbor);
  return found == solution.poses.end() ? nullptr : &*found;
}

Vector6d error_of(const TeamPose& pose, const Pose& truth) {
  return pose_difference(pose.T_B_N, truth);
}

double nees_of(const TeamPose& pose, const Pose& truth) {
  const Vector6d e = error_of(pose, truth);
  return e.dot(pose.pose_covariance().llt().solve(e));
}

double position_nees_of(const TeamPose& pose, const Pose& truth) {
  const Eigen::Vector3d e = error_of(pose, truth).head<3>();
  return e.dot(pose.covariance.topLeftCorner<3, 3>().llt().solve(e));
}

TeamSolution solution_after(SimulatedTeam& team, TeamFilter& filter, double seconds) {
  TeamSolution solution;
  for (double t = 0.0; t < seconds; t += kIntervalSeconds) solution = filter.step(team.next());
  return solution;
}

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

TEST(TeamFilter, ReachesARobotThatOnlyOthersSee) {
  constexpr RobotId kHidden{3};
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

// A robot whose camera is turned contradicts all others. They are as good as a team without it, and
// not much worse than with it when its camera is right.
TEST(TeamFilter, ATurnedCameraHarmsNobody) {
  constexpr RobotId kLiar{4};
  constexpr int kSeeds = 20;
  // Mean squared errors of the others in position.
  const auto error_with = [&](double turn_deg, bool has_liar) {
    const Eigen::Quaterniond turn = so3_exp(radians(turn_deg) * Eigen::Vector3d(0.6, 0.0, 0.8));
    double sum = 0.0;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      SimulatedTeam team(seed);
      team.damage = [&](TeamInterval& interval) {
        for (TeamBearing& b : interval.bearings)
          if (b.observer == kLiar) b.bearing.u_B = turn * b.bearing.u_B;
      };
      if (!has_liar) team.sees = [&](RobotId i, RobotId j) { return i != kLiar && j != kLiar; };
      TeamFilter filter;
      const TeamSolution solution = solution_after(team, filter, 10.0);
      for (const RobotId robot : {RobotId{2}, RobotId{3}}) {
        const TeamPose* pose = find(solution, robot);
        EXPECT_NE(pose, nullptr) << turn_deg << " deg, seed " << seed;
        if (pose != nullptr)
          sum += error_of(*pose, team.truth(robot)).head<3>().squaredNorm() / (2.0 * kSeeds);
      }
    }
    return sum;
  };
  const double alone = error_with(0.0, false);
  const double healthy = error_with(0.0, true);
  for (const double turn_deg : {5.0, 20.0}) {
    const double turned = error_with(turn_deg, true);
    EXPECT_LT(std::sqrt(turned), 1.2 * std::sqrt(alone)) << turn_deg;
    EXPECT_LT(std::sqrt(turned), 1.5 * std::sqrt(healthy)) << turn_deg;
  }
}

const TeamFault* fault_of(const TeamSolution& solution, RobotId robot) {
  const auto found = std::ranges::find(solution.faults, robot, &TeamFault::robot);
  return found == solution.faults.end() ? nullptr : &*found;
}

// Robots that start from what a turned camera sees take its carrier to be turned. Then only motion
// contradicts it, little by little. It is found before the others are wrong beyond their
// covariance.
TEST(TeamFilter, ACameraThatWasTurnedFromTheBeginningLeavesTheOthersHonest) {
  constexpr RobotId kLiar{4};
  int beyond = 0;
  int named = 0;
  constexpr int kSeeds = 20;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SimulatedTeam team(seed);
    const Eigen::Quaterniond turn = so3_exp(radians(20.0) * Eigen::Vector3d::UnitZ());
    team.damage = [&](TeamInterval& interval) {
      for (TeamBearing& b : interval.bearings)
        if (b.observer == kLiar) b.bearing.u_B = turn * b.bearing.u_B;
      for (RelativePoseEdge& edge : interval.edges) {
        Pose& T = edge.T_from_to.pose;
        if (edge.to == kLiar) T = T * Pose{Eigen::Vector3d::Zero(), turn.conjugate()};
        if (edge.from == kLiar) T = Pose{Eigen::Vector3d::Zero(), turn} * T;
      }
    };
    TeamFilter filter;
    TeamSolution solution;
    for (double t = 0.0; t < 12.0; t += kIntervalSeconds) {
      solution = filter.step(team.next());
      for (const RobotId robot : {RobotId{2}, RobotId{3}}) {
        const TeamPose* pose = find(solution, robot);
        if (pose != nullptr && position_nees_of(*pose, team.truth(robot)) > 35.0) ++beyond;
      }
    }
    named += fault_of(solution, kLiar) != nullptr ? 1 : 0;
    for (const RobotId robot : {kSelf, RobotId{2}, RobotId{3}})
      EXPECT_EQ(fault_of(solution, robot), nullptr) << "seed " << seed;
  }
  EXPECT_LE(beyond, 4);  // of some 4,700
  EXPECT_GE(named, kSeeds - 1);
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

TEST(TeamFilter, FindsNoFaultInAHealthyTeam) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SimulatedTeam team(seed);
    TeamFilter filter;
    for (double t = 0.0; t < 5.0; t += kIntervalSeconds) {
      for (const TeamFault& fault : filter.step(team.next()).faults) {
        ADD_FAILURE() << "seed " << seed << " at " << t << " s, robot " << fault.robot.value
                      << ": kind " << static_cast<int>(fault.kind) << ", " << fault.size;
      }
    }
  }
}

// Found by how much, or left out: both are safe.
TEST(TeamFilter, NamesATurnedCamera) {
  constexpr RobotId kLiar{4};
  int measured = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SimulatedTeam team(seed);
    TeamFilter filter;
    static_cast<void>(solution_after(team, filter, 3.0));
    const Eigen::Quaterniond turn = so3_exp(radians(8.0) * Eigen::Vector3d(0.6, 0.0, 0.8));
    team.damage = [&](TeamInterval& interval) {
      for (TeamBearing& b : interval.bearings)
        if (b.observer == kLiar) b.bearing.u_B = turn * b.bearing.u_B;
    };
    const TeamSolution solution = solution_after(team, filter, 5.0);
    const TeamFault* fault = fault_of(solution, kLiar);
    ASSERT_NE(fault, nullptr) << seed;
    EXPECT_NE(fault->kind, TeamFault::Kind::kRanges);
    EXPECT_NE(fault->kind, TeamFault::Kind::kGyro);
    if (fault->kind == TeamFault::Kind::kCameraTurned) {
      EXPECT_NEAR(fault->size, radians(8.0), radians(1.0)) << seed;
      ++measured;
    }
    for (const RobotId robot : {RobotId{2}, RobotId{3}}) {
      ASSERT_NE(find(solution, robot), nullptr);
      EXPECT_LT(nees_of(*find(solution, robot), team.truth(robot)), 30.0) << seed;
      EXPECT_EQ(fault_of(solution, robot), nullptr) << seed;
    }
  }
  EXPECT_GE(measured, 2);
}

// As when its pair's filter believed it from the beginning: its place fits its own ranges, and all
// others' contradict. Nobody else is drawn along.
TEST(TeamFilter, ARobotThatStartsByItsOwnLongRangesMovesNobody) {
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
TEST(TeamFilter, AnAntennaDelayThatCameFirstIsOutvoted) {
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

/// Its gyroscope reads nearly twice its rate.
void scale_gyro(TeamInterval& interval, RobotId robot) {
  for (TeamMember& member : interval.members)
    if (member.robot == robot)
      for (ImuMean& mean : member.imu) mean.gyro_radps *= 1.9;
}

TEST(TeamFilter, NamesAFalseGyroscopeAndIsWithoutThatRobotAsLongAsItLasts) {
  constexpr RobotId kLiar{4};
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SimulatedTeam team(seed);
    TeamFilter filter;
    static_cast<void>(solution_after(team, filter, 3.0));
    team.damage = [&](TeamInterval& interval) { scale_gyro(interval, kLiar); };
    TeamSolution solution;
    bool is_named = false;
    for (double t = 0.0; t < 3.0; t += kIntervalSeconds) {
      solution = filter.step(team.next());
      const TeamFault* fault = fault_of(solution, kLiar);
      is_named = is_named || (fault != nullptr && fault->kind == TeamFault::Kind::kGyro);
      for (const RobotId robot : {RobotId{2}, RobotId{3}}) {
        const TeamPose* pose = find(solution, robot);
        ASSERT_NE(pose, nullptr) << seed;
        EXPECT_LT(nees_of(*pose, team.truth(robot)), 30.0) << seed << " at " << t;
      }
    }
    EXPECT_TRUE(is_named) << seed;
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
TEST(TeamFilter, RecoversFromItsOwnFalseGyroscope) {
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

TEST(TeamFilter, NamesRangesThatAreTooLong) {
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

// All sensors of a robot are stamped 20 ms late. These robots are slow, so it takes some seconds.
TEST(TeamFilter, NamesAClockThatIsOff) {
  constexpr RobotId kLiar{4};
  constexpr double kLate = 0.02;  // s
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SimulatedTeam team(seed);
    team.late_s[kLiar] = kLate;
    TeamFilter filter;
    const TeamSolution solution = solution_after(team, filter, 10.0);
    ASSERT_EQ(solution.faults.size(), 1U) << seed;
    const TeamFault& fault = solution.faults.front();
    EXPECT_EQ(fault.robot, kLiar);
    EXPECT_EQ(fault.kind, TeamFault::Kind::kClock);
    EXPECT_NEAR(fault.size, kLate, 0.008) << seed;
    for (const RobotId robot : {RobotId{2}, RobotId{3}}) {
      const TeamPose* pose = find(solution, robot);
      ASSERT_NE(pose, nullptr) << seed;
      EXPECT_LT(nees_of(*pose, team.truth(robot)), 30.0) << seed;
    }
  }
}

// The frame moves on by what this robot's own clock says.
TEST(TeamFilter, NamesItselfIfItsOwnClockIsOff) {
  SimulatedTeam team(1);
  team.late_s[kSelf] = 0.02;
  TeamFilter filter;
  const TeamSolution solution = solution_after(team, filter, 10.0);
  ASSERT_EQ(solution.faults.size(), 1U);
  EXPECT_EQ(solution.faults.front().robot, kSelf);
  EXPECT_EQ(solution.faults.front().kind, TeamFault::Kind::kClock);
  EXPECT_GT(solution.faults.front().size, 0.0);
}

// All estimates of a robot are a metre off at a sigma of 5 cm.
TEST(TeamFilter, ARobotThatStartsAtAWrongPlaceMovesNobody) {
  constexpr RobotId kLiar{4};
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SimulatedTeam team(seed);
    team.damage = [&](TeamInterval& interval) {
      for (RelativePoseEdge& edge : interval.edges) {
        if (edge.to == kLiar) edge.T_from_to.pose.p += Eigen::Vector3d(0.6, 0.0, 0.8);
        if (edge.from == kLiar) edge.T_from_to.pose.p -= Eigen::Vector3d(0.6, 0.0, 0.8);
      }
    };
    TeamFilter filter;
    for (double t = 0.0; t < 8.0; t += kIntervalSeconds) {
      const bool are_alone = t < kProbation;
      team.sees = [=](RobotId i, RobotId j) {
        return !are_alone || std::set{i, j} == std::set{kSelf, kLiar};
      };
      for (const TeamPose& pose : filter.step(team.next()).poses) {
        if (pose.neighbor == kLiar) continue;
        EXPECT_LT(nees_of(pose, team.truth(pose.neighbor)), 40.0) << seed << " at " << t;
      }
    }
    const TeamSolution solution = solution_after(team, filter, kIntervalSeconds);
    for (const TeamPose& pose : solution.poses)
      EXPECT_LT(nees_of(pose, team.truth(pose.neighbor)), 40.0) << seed;
    EXPECT_EQ(solution.poses.size(), 3U) << seed;
  }
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

TEST(TeamFilter, LocatesRobotsBeyondItsSizeThroughTheOthers) {
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
TEST(TeamFilter, ABetterConnectedRobotTakesThePlaceOfAPoorlyConnectedOne) {
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

TEST(TeamFilter, EquallyConnectedRobotsKeepTheirPlaces) {
  SimulatedTeam team(1, 6);
  team.damage = [](TeamInterval& interval) { interval.settings.max_robots = 4; };
  TeamFilter filter;
  const auto first = estimated_jointly(solution_after(team, filter, 3.0));
  EXPECT_EQ(first.size(), 3U);
  for (double t = 0.0; t < 6.0; t += kIntervalSeconds)
    ASSERT_EQ(estimated_jointly(filter.step(team.next())), first) << t;
}

/// What becomes of a robot that nobody sees any more, and that sees nobody.
struct InTheDark {
  int located = 0;  ///< teams in which its place is known to half a meter in the end
  int poses = 0;
  int beyond = 0;  ///< five sigma, of all robots
};

InTheDark in_the_dark(RobotId dark, double seconds, bool has_ranges) {
  InTheDark result;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SimulatedTeam team(seed, 6);
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

TEST(TeamFilter, RangesLocateARobotThatNobodySees) {
  const InTheDark with = in_the_dark(RobotId{4}, 30.0, true);
  EXPECT_EQ(with.beyond, 0) << "of " << with.poses;
  EXPECT_GE(with.located, 5);
  const InTheDark without = in_the_dark(RobotId{4}, 30.0, false);
  EXPECT_EQ(without.beyond, 0) << "of " << without.poses;
  EXPECT_EQ(without.located, 0);
}

TEST(TeamFilter, RangesLocateTheTeamForARobotThatSeesNobody) {
  const InTheDark with = in_the_dark(kSelf, 30.0, true);
  EXPECT_EQ(with.beyond, 0) << "of " << with.poses;
  EXPECT_GE(with.located, 5);
}

// A chain of estimates has the errors of the others' cameras, too, which the filter has used.
TEST(TeamFilter, RobotsBeyondItsSizeAreHonestOverSeeds) {
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
}  // namespace crepes
