#include "estimator/team/trust/team_memory.hpp"

#include <gtest/gtest.h>

#include "tests/support/simulated_belief.hpp"

namespace crepes::team_memory_test {
namespace {

using namespace std::chrono_literals;
using test::kSelf;
using test::SimulatedTeam;

constexpr RobotId kOther{2};
constexpr Timestamp kStart{100s};

TeamBelief belief_at(Timestamp stamp) {
  SimulatedTeam team(1);
  const test::TrueMotions motions = test::motions_of(team);
  TeamBelief belief = test::true_belief(motions, team.next());
  belief.stamp = stamp;
  return belief;
}

TEST(TeamMemory, RecallsTheNewestBeliefOfBeforeTheFault) {
  TeamMemory memory;
  for (Duration age = 0s; age <= 10s; age += 100ms) memory.add(belief_at(kStart + age));
  const auto recalled = memory.recall(kStart + 10s);
  ASSERT_TRUE(recalled);
  EXPECT_EQ(recalled->stamp, kStart + 8s);
  // What came later may be spoilt, however long ago it is by now.
  const auto again = memory.recall(kStart + 12s);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->stamp, kStart + 8s);
}

TEST(TeamMemory, HasNothingOfATeamThatIsYoungerThanAFaultMayBe) {
  TeamMemory memory;
  memory.add(belief_at(kStart));
  EXPECT_FALSE(memory.recall(kStart + 1s));
}

TEST(TeamMemory, ForgetsARobotThatLeft) {
  TeamMemory memory;
  memory.add(belief_at(kStart));
  memory.remove(kOther);
  const auto recalled = memory.recall(kStart + 3s);
  ASSERT_TRUE(recalled);
  EXPECT_FALSE(recalled->robots.contains(kOther));
}

// What is recalled is older than the vibration.
TEST(TeamMemory, RemembersHowTheImusVibratedSince) {
  SimulatedTeam team(1);
  TeamInterval interval = team.next();
  TeamMemory memory;
  memory.add(belief_at(kStart));
  const double before = memory.recall(kStart + 3s)->P.diagonal().sum();
  constexpr double kVariance = 1e-4;
  for (ImuMean& mean : interval.members.at(1).imu) mean.bias_variance_m2ps4 = kVariance;
  for (int i = 0; i < 2; ++i) memory.add_vibration(interval);
  const auto recalled = memory.recall(kStart + 3s);
  const auto steps = static_cast<double>(interval.members.at(1).imu.size());
  EXPECT_NEAR(recalled->P.diagonal().sum() - before, 2.0 * 3.0 * steps * kVariance, 1e-9);
}

TEST(TeamMemory, OfABeliefKeepsTheCalibrationsAndNoPlace) {
  SimulatedTeam team(1);
  const test::TrueMotions motions = test::motions_of(team);
  TeamInterval interval = team.next();
  TeamBelief earlier = test::true_belief(motions, interval);
  TeamRobot& robot = earlier.robots.at(kOther);
  robot.bias.gyro_radps = {0.01, 0.02, 0.03};
  const int bias = robot.bias_index;
  earlier.P.block<3, 3>(bias, bias).diagonal().setConstant(1e-6);
  earlier.P(robot.motion_index, bias) = earlier.P(bias, robot.motion_index) = 1e-5;

  interval = team.next();
  const TeamBelief belief = earlier.calibrations_at(interval);
  EXPECT_EQ(belief.stamp, interval.from);
  const TeamRobot& kept = belief.robots.at(kOther);
  EXPECT_EQ(kept.bias.gyro_radps, robot.bias.gyro_radps);
  EXPECT_GE(belief.P(kept.bias_index, kept.bias_index), 1e-6);  // it has drifted
  EXPECT_LT(belief.P(kept.bias_index, kept.bias_index), 1.1e-6);
  EXPECT_EQ(belief.P(kept.motion_index, kept.bias_index), 0.0);
  EXPECT_EQ(belief.P, belief.P.transpose());

  std::erase_if(interval.members, [](const TeamMember& m) { return m.robot == kOther; });
  EXPECT_FALSE(earlier.calibrations_at(interval).robots.contains(kOther));
}

TEST(TeamMemory, AnImuInDoubtIsAsUncertainAsANewOneAndItsErrorsAreTheBestGuess) {
  SimulatedTeam team(1);
  const test::TrueMotions motions = test::motions_of(team);
  TeamBelief belief = test::true_belief(motions, team.next());
  TeamRobot& self = belief.robots.at(kSelf);
  self.bias.gyro_radps = {0.01, 0.02, 0.03};
  const int bias = self.bias_index;
  belief.P.block<3, 3>(bias, bias).diagonal().setConstant(1e-6);
  const Priors priors = test::team_settings().priors;
  belief.doubt_imu(kSelf, priors);
  EXPECT_EQ(belief.robots.at(kSelf).bias.gyro_radps, Eigen::Vector3d(0.01, 0.02, 0.03));
  EXPECT_DOUBLE_EQ(belief.P(bias, bias), priors.gyro_bias_radps * priors.gyro_bias_radps);
  EXPECT_EQ(belief.P.row(bias).sum(), belief.P(bias, bias));
}

}  // namespace
}  // namespace crepes::team_memory_test
