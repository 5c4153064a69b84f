#include "estimator/team/trust/estimate_check.hpp"

#include <gtest/gtest.h>

#include "tests/support/simulated_belief.hpp"

namespace crepes::estimate_check_test {
namespace {

using test::SimulatedTeam;

constexpr RobotId kLiar{4};

/// The faults after some intervals.
std::vector<TeamFault> faults_after(SimulatedTeam& team, int intervals) {
  EstimateCheck check;
  for (int i = 0; i < intervals; ++i) {
    const TeamInterval interval = team.next();
    check.add(interval, test::true_belief(test::motions_of(team), interval));
  }
  return check.faults();
}

void displace(RelativePoseEdge& edge, double size_m) {
  edge.T_from_to.pose.p(edge.to.value % 3) += size_m;
  edge.T_from_to.covariance = 1e-6 * Matrix6d::Identity();
}

TEST(EstimateCheck, NamesOnlyWhoseEstimatesAreFarOff) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SimulatedTeam team(seed);
    EXPECT_TRUE(faults_after(team, 20).empty()) << seed;
    team.damage = [](TeamInterval& interval) {
      for (RelativePoseEdge& edge : interval.edges)
        if (edge.from == kLiar) displace(edge, 2.0);
    };
    const auto faults = faults_after(team, 10);
    ASSERT_EQ(faults.size(), 1U) << seed;
    EXPECT_EQ(faults.front().robot, kLiar);
    EXPECT_EQ(faults.front().kind, TeamFault::Kind::kEstimates);
    EXPECT_NEAR(faults.front().size, 2.0, 0.4);
  }
}

// A robot that one other robot's estimate contradicts may be that one's fault.
TEST(EstimateCheck, OneWrongEstimateIsNoFault) {
  SimulatedTeam team(1);
  team.damage = [](TeamInterval& interval) {
    for (RelativePoseEdge& edge : interval.edges)
      if (edge.from == kLiar && edge.to == RobotId{2}) displace(edge, 2.0);
  };
  EXPECT_TRUE(faults_after(team, 20).empty());
}

TEST(EstimateCheck, AnEstimateThatSaysHowBadItIsIsNoFault) {
  SimulatedTeam team(1);
  team.damage = [](TeamInterval& interval) {
    for (RelativePoseEdge& edge : interval.edges) {
      if (edge.from != kLiar) continue;
      displace(edge, 0.8);
      edge.T_from_to.covariance = Matrix6d::Identity();
    }
  };
  EXPECT_TRUE(faults_after(team, 20).empty());
}

TEST(EstimateCheck, ForgetsWhenTheyAreRightAgain) {
  SimulatedTeam team(1);
  EstimateCheck check;
  const auto run = [&](bool is_wrong) {
    team.damage = [is_wrong](TeamInterval& interval) {
      for (RelativePoseEdge& edge : interval.edges)
        if (edge.from == kLiar && is_wrong) displace(edge, 2.0);
    };
    for (int i = 0; i < 20; ++i) {
      const TeamInterval interval = team.next();
      check.add(interval, test::true_belief(test::motions_of(team), interval));
    }
  };
  run(true);
  EXPECT_EQ(check.faults().size(), 1U);
  run(false);
  EXPECT_TRUE(check.faults().empty());
}

}  // namespace
}  // namespace crepes::estimate_check_test
