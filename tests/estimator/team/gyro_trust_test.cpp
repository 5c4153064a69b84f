// What the team concludes from gyroscopes that contradict what their cameras see.
#include <gtest/gtest.h>

#include "estimator/team/trust/team_trust.hpp"
#include "tests/estimator/team/trust_of_four.hpp"

namespace crepes::gyro_trust_test {
namespace {

using test::Ids;
using test::kAccused;
using test::kContradicts;
using test::kSecond;
using test::kSelf;
using test::kThird;
using namespace std::chrono_literals;

using GyroTrust = test::TrustOfFour;

TEST_F(GyroTrust, AGyroscopeIsFalseAfterSomeContradictionsAndForASecond) {
  const std::map<RobotId, GyroCheck> checks{
      {kAccused, {.chi2 = 50.0, .dimension = 6, .contradiction = {{40.0, 0.5, false}}}},
      {kSecond, {.chi2 = 6.0, .dimension = 6, .contradiction = {}}}};
  EXPECT_TRUE(trust_.note_false_gyros(interval_, belief_, checks).empty());
  EXPECT_EQ(trust_.note_false_gyros(interval_, belief_, checks), Ids{kAccused});
  ASSERT_EQ(trust_.gyro_faults(belief_.stamp).size(), 1U);
  EXPECT_EQ(trust_.gyro_faults(belief_.stamp).front().robot, kAccused);
  EXPECT_EQ(trust_.gyro_faults(belief_.stamp).front().size, 0.5);
  EXPECT_TRUE(trust_.gyro_faults(belief_.stamp + 1s).empty());
}

// The light of a single robot may have leapt, as to its mirror image.
TEST_F(GyroTrust, OneRobotMustContradictAGyroscopeInTwoIntervalsOnEnd) {
  const std::map<RobotId, GyroCheck> checks{
      {kAccused, {.chi2 = 200.0, .dimension = 2, .contradiction = {{200.0, 0.5, true}}}}};
  const auto next = [&](const std::map<RobotId, GyroCheck>& of_interval) {
    interval_.from = interval_.to;
    interval_.to += 100ms;
    return trust_.note_false_gyros(interval_, belief_, of_interval);
  };
  EXPECT_TRUE(next(checks).empty());
  EXPECT_TRUE(next({}).empty());
  EXPECT_TRUE(next(checks).empty());
  EXPECT_EQ(next(checks), Ids{kAccused});
}

// Its gyroscope may have been false for longer than it saw anybody. So its attitude is wrong, and
// neither its camera nor what it sees.
TEST_F(GyroTrust, AfterAFalseGyroscopeACameraThatAgreesWithNobodyShowsAWrongAttitude) {
  const auto false_gyros = [&](const std::map<RobotId, GyroCheck>& checks) {
    return trust_.note_false_gyros(interval_, belief_, checks);
  };
  const auto sees_one_in_the_wrong_place = [&] {
    camera_of(kAccused).agreement = {{kSecond, kContradicts}};
    for (const RobotId other : {kSelf, kThird}) camera_of(other).agreement.erase(kSecond);
  };
  const std::map<RobotId, GyroCheck> contradiction{
      {kAccused, {.chi2 = 100.0, .dimension = 6, .contradiction = {{100.0, 0.5, false}}}}};
  contradict_what_it_sees(kAccused);
  EXPECT_TRUE(false_gyros({}).empty()) << "nothing was wrong with its gyroscope";

  all_agree_again();
  EXPECT_EQ(false_gyros(contradiction), Ids{kAccused});
  wait(1s);
  EXPECT_TRUE(false_gyros({}).empty());
  contradict_what_it_sees(kAccused);
  EXPECT_TRUE(lost().empty());
  EXPECT_TRUE(turned().empty());
  EXPECT_EQ(false_gyros({}), Ids{kAccused});
  sees_one_in_the_wrong_place();
  EXPECT_TRUE(lost().empty());
  EXPECT_EQ(false_gyros({}), Ids{kAccused});
  wait(1500ms);
  EXPECT_EQ(false_gyros({}), Ids{kAccused}) << "nothing has confirmed its gyroscope";
  const std::map<RobotId, GyroCheck> confirmation{
      {kAccused, {.chi2 = 3.0, .dimension = 2, .is_confirmed = true, .contradiction = {}}}};
  EXPECT_EQ(false_gyros(confirmation), Ids{kAccused}) << "it may just have ended";
  wait(1400ms);
  EXPECT_EQ(false_gyros({}), Ids{kAccused});
  wait(100ms);  // two seconds after the time until which it may have been false at most
  EXPECT_TRUE(false_gyros({}).empty());
}

TEST_F(GyroTrust, AProbationIsLongerForAMinuteAfterTheGyroscopeWasFalseAgain) {
  const std::map<RobotId, GyroCheck> contradiction{
      {kAccused, {.chi2 = 100.0, .dimension = 6, .contradiction = {{100.0, 0.5, false}}}}};
  TeamRobot& robot = belief_.robots.at(kAccused);
  const auto is_trusted_after = [&](Duration probation) {
    robot.is_trusted = false;
    robot.since = belief_.stamp - probation;
    trust_.end_probations(belief_);
    return robot.is_trusted;
  };
  for (int i = 0; i < 3; ++i) {
    robot.is_trusted = true;
    EXPECT_EQ(trust_.note_false_gyros(interval_, belief_, contradiction), Ids{kAccused});
    wait(5s);
  }
  EXPECT_FALSE(is_trusted_after(3900ms));
  EXPECT_TRUE(is_trusted_after(4s));
  wait(54s);
  EXPECT_FALSE(is_trusted_after(3900ms));
  wait(1s);
  EXPECT_TRUE(is_trusted_after(1s));
}

TEST_F(GyroTrust, AConfirmedGyroscopeExcusesNothingAfterTwoSeconds) {
  const std::map<RobotId, GyroCheck> contradiction{
      {kAccused, {.chi2 = 100.0, .dimension = 6, .contradiction = {{100.0, 0.5, false}}}}};
  const std::map<RobotId, GyroCheck> confirmation{
      {kAccused, {.chi2 = 3.0, .dimension = 6, .is_confirmed = true, .contradiction = {}}}};
  EXPECT_EQ(trust_.note_false_gyros(interval_, belief_, contradiction), Ids{kAccused});
  EXPECT_TRUE(trust_.note_false_gyros(interval_, belief_, confirmation).empty());
  wait(2s);
  contradict_what_it_sees(kAccused);
  EXPECT_TRUE(trust_.note_false_gyros(interval_, belief_, confirmation).empty());
  EXPECT_EQ(turned(), Ids{kAccused});
}

}  // namespace
}  // namespace crepes::gyro_trust_test
