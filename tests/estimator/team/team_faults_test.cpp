/// The filter of a team in which a robot lies: its camera is turned, its clock is off, or its
/// estimates are false. See also team_gyro_faults_test.cpp and team_range_faults_test.cpp.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>
#include <utility>

#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"
#include "estimator/team/team_filter.hpp"
#include "tests/estimator/team/fault_of.hpp"
#include "tests/support/simulated_team.hpp"
#include "tests/support/team_solution.hpp"

namespace crepes::team_faults_test {
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

// A robot whose camera is turned contradicts all others. They are as good as a team without it, and
// not much worse than with it when its camera is right.
TEST(TeamFaults, ATurnedCameraHarmsNobody) {
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

// Between two intervals, or within one. What was known before goes on: only the camera's
// calibration is lost, and is there again at once. Later it is knocked back.
TEST(TeamFaults, ACameraThatIsKnockedIsRealignedInPlace) {
  const Eigen::Quaterniond turn = so3_exp(radians(2.0) * Eigen::Vector3d(0.6, 0.0, 0.8));
  for (const RobotId knocked : {RobotId{4}, kSelf}) {
    for (const double within_s : {0.0, 0.06}) {
      for (std::uint64_t seed = 1; seed <= 5; ++seed) {
        const auto label = testing::Message()
                           << "robot " << knocked.value << ", " << within_s << " s, seed " << seed;
        SimulatedTeam team(seed);
        TeamFilter filter;
        const TeamSolution before = solution_after(team, filter, 8.0);
        const Timestamp hit = filter.belief().stamp + from_seconds(within_s);
        const Timestamp hit_back = hit + from_seconds(3.0);
        team.damage = [&](TeamInterval& interval) {
          for (TeamBearing& b : interval.bearings)
            if (b.observer == knocked && b.bearing.stamp >= hit && b.bearing.stamp < hit_back)
              b.bearing.u_B = turn * b.bearing.u_B;
        };
        const auto next = [&] {
          TeamSolution solution = filter.step(team.next());
          for (const RobotId robot : {RobotId{2}, RobotId{3}, RobotId{4}}) {
            const TeamPose* pose = find(solution, robot);
            EXPECT_NE(pose, nullptr) << label;
            if (pose != nullptr) EXPECT_LT(nees_of(*pose, team.truth(robot)), 40.0) << label;
          }
          return solution;
        };
        TeamSolution solution;
        while (filter.belief().stamp < hit_back) solution = next();
        const TeamFault* fault = fault_of(solution, knocked);
        ASSERT_NE(fault, nullptr) << label;
        EXPECT_EQ(fault->kind, TeamFault::Kind::kCameraTurned) << label;
        EXPECT_NEAR(fault->size, radians(2.0), radians(0.5)) << label;
        EXPECT_TRUE(find(solution, RobotId{4})->was_knocked) << label;
        EXPECT_EQ(find(solution, RobotId{2})->was_knocked, knocked == kSelf) << label;
        for (const RobotId robot : {RobotId{2}, RobotId{3}})
          EXPECT_LT(camera_sigma_rad(solution, robot), 1.05 * camera_sigma_rad(before, robot))
              << label;

        while (filter.belief().stamp < hit_back + from_seconds(2.0)) solution = next();
        EXPECT_EQ(fault_of(solution, knocked), nullptr) << label;
      }
    }
  }
}

// It sees one of the two less often, so that it contradicts the other one first.
TEST(TeamFaults, AKnockedCameraOfATeamOfThreeTakesNobodysPlace) {
  const auto direction = [](const TeamInterval& interval, RobotId neighbor) {
    return std::ranges::find_if(interval.bearings,
                                [&](const TeamBearing& b) {
                                  return b.observer == kSelf && b.bearing.neighbor == neighbor;
                                })
        ->bearing.u_B;
  };
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SimulatedTeam team(seed, 3);
    TeamFilter filter;
    static_cast<void>(solution_after(team, filter, 8.0));
    int intervals = 0;
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
    team.damage = [&](TeamInterval& interval) {
      if (intervals++ == 0) {  // across both directions
        const Eigen::Vector3d across =
            direction(interval, RobotId{2}).cross(direction(interval, RobotId{3}));
        turn = so3_exp(radians(2.0) * across.normalized());
      }
      std::erase_if(interval.bearings, [&](const TeamBearing& b) {
        return b.observer == kSelf && b.bearing.neighbor == RobotId{3} && intervals % 3 != 2;
      });
      for (TeamBearing& b : interval.bearings)
        if (b.observer == kSelf) b.bearing.u_B = turn * b.bearing.u_B;
    };
    TeamSolution solution;
    for (int i = 0; i < 40; ++i) {
      solution = filter.step(team.next());
      for (const RobotId robot : {RobotId{2}, RobotId{3}}) {
        const TeamPose* pose = find(solution, robot);
        ASSERT_NE(pose, nullptr) << seed << ", " << i;
        EXPECT_LT(nees_of(*pose, team.truth(robot)), 40.0) << seed << ", " << i;
      }
    }
    EXPECT_NE(fault_of(solution, kSelf), nullptr) << seed;
  }
}

// A crowded mesh carries four bearings a second of each pair.
TEST(TeamFaults, ATurnedCameraIsFoundHoweverRareItsBearingsAre) {
  constexpr RobotId kTurned{4};
  const Eigen::Quaterniond turn = so3_exp(radians(10.0) * Eigen::Vector3d::UnitX());
  for (const int every : {1, 2, 3}) {
    SimulatedTeam team(1);
    TeamFilter filter;
    int intervals = 0;
    bool is_turned = false;
    team.damage = [&](TeamInterval& interval) {
      const bool is_silent = ++intervals % every != 0;
      std::set<std::pair<RobotId, RobotId>> pairs;  // the first of each
      std::erase_if(interval.bearings, [&](const TeamBearing& b) {
        return is_silent || !pairs.insert({b.observer, b.bearing.neighbor}).second;
      });
      for (TeamBearing& b : interval.bearings)
        if (is_turned && b.observer == kTurned) b.bearing.u_B = turn * b.bearing.u_B;
    };
    EXPECT_EQ(fault_of(solution_after(team, filter, 10.0), kTurned), nullptr) << every;
    is_turned = true;
    EXPECT_NE(fault_of(solution_after(team, filter, 4.0), kTurned), nullptr) << every;
  }
}

// Robots that start from what a turned camera sees take its carrier to be turned. Then only motion
// contradicts it, little by little. It is found before the others are wrong beyond their
// covariance.
TEST(TeamFaults, ACameraThatWasTurnedFromTheBeginningLeavesTheOthersHonest) {
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

TEST(TeamFaults, FindsNoFaultInAHealthyTeam) {
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
TEST(TeamFaults, NamesATurnedCamera) {
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

// All sensors of a robot are stamped 20 ms late. These robots are slow, so it takes some seconds.
TEST(TeamFaults, NamesAClockThatIsOff) {
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
TEST(TeamFaults, NamesItselfIfItsOwnClockIsOff) {
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
TEST(TeamFaults, ARobotThatStartsAtAWrongPlaceMovesNobody) {
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

// A robot that has just started has no estimates yet, and another one sends a false one of it: at
// its own place, or turned.
TEST(TeamFaults, APoseByAFalseEstimateNeedsAWitnessUntilBearingsAgree) {
  constexpr RobotId kLiar{3};
  constexpr RobotId kStarted{4};
  const Pose kBeside{{0.05, 0.0, 0.0}, Eigen::Quaterniond::Identity()};
  const Pose kTurned{{0.0, 0.0, 0.0}, so3_exp(Eigen::Vector3d(0.0, 0.0, 2.4))};
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SimulatedTeam team(seed);
    team.damage = [&](TeamInterval& interval) {
      std::erase_if(interval.edges, [&](const RelativePoseEdge& edge) {
        return edge.from == kStarted || (edge.to == kStarted && edge.from != kLiar);
      });
      for (RelativePoseEdge& edge : interval.edges) {
        if (edge.to != kStarted) continue;
        edge.T_from_to.pose = seed % 2 == 0 ? kBeside : edge.T_from_to.pose * kTurned;
      }
    };
    TeamFilter filter;
    int published = 0;
    for (double t = 0.0; t < 3.0; t += kIntervalSeconds) {
      for (const TeamPose& pose : filter.step(team.next()).poses) {
        if (pose.needs_confirmation) continue;
        EXPECT_LT(nees_of(pose, team.truth(pose.neighbor)), 40.0)
            << seed << " at " << t << ": " << pose.neighbor.value;
        published += pose.neighbor == kStarted ? 0 : 1;
      }
    }
    EXPECT_GT(published, 10) << seed;
  }
}

}  // namespace
}  // namespace crepes::team_faults_test
