#include "estimator/swarm/team_intake.hpp"

#include <gtest/gtest.h>

#include "tests/support/resting_pair.hpp"

namespace crepes::team_intake_test {
namespace {

using namespace std::chrono_literals;
using test::resting::at_ms;
using test::resting::imu_at_rest;

constexpr RobotId kOwn{1};
constexpr RobotId kPeer{2};
constexpr RobotId kStranger{9};

/// Two members whose IMUs read until `imu_end_ms`.
class Intake : public testing::Test {
 protected:
  Intake() {
    for (const RobotId id : {kOwn, kPeer}) {
      MemberConfig member;
      member.id = id;
      member.p_body_led = {0.0, 0.0, 0.1 * id.value};
      swarm_.members.push_back(member);
    }
  }

  [[nodiscard]] std::optional<TeamInterval> drain(int now_ms) {
    return intake_.drain(kOwn, at_ms(now_ms), swarm_, settings_,
                         [this](RobotId robot) { return robot == kPeer ? peer_imu_ : &imu_; });
  }
  /// Bearings of the peer to us, at these times.
  void report(const std::vector<int>& bearings_ms, RobotId of = kOwn, double sigma_rad = 1e-3) {
    Report report;
    report.sender = kPeer;
    for (const int ms : bearings_ms)
      report.bearings.push_back({.stamp = at_ms(ms), .neighbor = of, .sigma_rad = sigma_rad});
    intake_.add_report(report, 0.0, swarm_, settings_);
  }

  FilterSettings settings_ = test::resting::settings();
  SwarmConfig swarm_;
  ImuHistory imu_ = imu_at_rest(1000);
  const ImuHistory* peer_imu_ = &imu_;
  TeamIntake intake_;
};

int lag_ms(const FilterSettings& settings) {
  return static_cast<int>(
      std::chrono::duration_cast<std::chrono::milliseconds>(settings.lag).count());
}

TEST_F(Intake, IntervalsFollowEachOtherWithoutAGap) {
  const int lag = lag_ms(settings_);
  const auto first = drain(400 + lag);
  const auto second = drain(500 + lag);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->to, at_ms(400));
  EXPECT_EQ(second->from, first->to);
  EXPECT_EQ(second->to, at_ms(500));
  EXPECT_FALSE(drain(500 + lag)) << "no time has passed";
}

TEST_F(Intake, AReadingIsInOneIntervalInOrderOfItsTime) {
  const int lag = lag_ms(settings_);
  static_cast<void>(drain(400 + lag));
  report({450, 410, 500, 501});
  const auto interval = drain(500 + lag);
  ASSERT_TRUE(interval);
  ASSERT_EQ(interval->bearings.size(), 3U);
  EXPECT_EQ(interval->bearings[0].bearing.stamp, at_ms(410));
  EXPECT_EQ(interval->bearings[1].bearing.stamp, at_ms(450));
  EXPECT_EQ(interval->bearings[2].bearing.stamp, at_ms(500));
  const auto next = drain(600 + lag);
  ASSERT_EQ(next->bearings.size(), 1U);
  EXPECT_EQ(next->bearings[0].bearing.stamp, at_ms(501));
}

TEST_F(Intake, AReadingThatComesTooLateIsLost) {
  const int lag = lag_ms(settings_);
  static_cast<void>(drain(400 + lag));
  report({399});
  EXPECT_TRUE(drain(600 + lag)->bearings.empty());
}

// Of each bearing that comes later than the lag, so that one in a hundred does.
TEST_F(Intake, TheLagFollowsLateReadings) {
  const int lag = lag_ms(settings_);
  static_cast<void>(drain(400 + lag));
  for (int i = 0; i < 50; ++i) report({300});
  const auto interval = drain(600 + lag);
  ASSERT_TRUE(interval);
  EXPECT_LT(interval->to, at_ms(560));
}

TEST_F(Intake, NoCameraIsBetterThanPhysics) {
  const int lag = lag_ms(settings_);
  report({100}, kOwn, 1e-9);
  const auto interval = drain(400 + lag);
  ASSERT_EQ(interval->bearings.size(), 1U);
  EXPECT_GE(interval->bearings[0].bearing.sigma_rad, 1e-4);
}

TEST_F(Intake, IgnoresStrangersAndRobotsThatSeeThemselves) {
  const int lag = lag_ms(settings_);
  report({100}, kStranger);
  report({100}, kPeer);
  EXPECT_TRUE(drain(400 + lag)->bearings.empty());
}

TEST_F(Intake, OwnReportsThatRepeatCountOnce) {
  const int lag = lag_ms(settings_);
  Report report;
  report.sender = kOwn;
  report.bearings.push_back({.stamp = at_ms(100), .neighbor = kPeer, .sigma_rad = 1e-3});
  intake_.add_own_report(report, swarm_, settings_);
  report.bearings.push_back({.stamp = at_ms(110), .neighbor = kPeer, .sigma_rad = 1e-3});
  intake_.add_own_report(report, swarm_, settings_);
  EXPECT_EQ(drain(400 + lag)->bearings.size(), 2U);
}

TEST_F(Intake, OwnBearingsCountThoughTheCameraIsSlowerThanTheRanges) {
  const int lag = lag_ms(settings_);
  Report report;
  report.sender = kOwn;
  report.ranges.push_back({.stamp = at_ms(150), .neighbor = kPeer, .range_m = 4.0});
  report.bearings.push_back({.stamp = at_ms(130), .neighbor = kPeer, .sigma_rad = 1e-3});
  intake_.add_own_report(report, swarm_, settings_);
  report.bearings.push_back({.stamp = at_ms(140), .neighbor = kPeer, .sigma_rad = 1e-3});
  report.bearings.push_back(
      {.stamp = at_ms(120), .neighbor = kPeer, .p_B_C = {0.0, 0.0, 0.1}, .sigma_rad = 1e-3});
  intake_.add_own_report(report, swarm_, settings_);

  const auto interval = drain(400 + lag);

  EXPECT_EQ(interval->bearings.size(), 3U);
  EXPECT_EQ(interval->ranges.size(), 1U);
}

TEST_F(Intake, ARobotWithoutImuIsNoMember) {
  const int lag = lag_ms(settings_);
  EXPECT_EQ(drain(400 + lag)->members.size(), 2U);
  peer_imu_ = nullptr;
  const auto without = drain(500 + lag);
  ASSERT_EQ(without->members.size(), 1U);
  EXPECT_EQ(without->members[0].robot, kOwn);
  EXPECT_EQ(without->members[0].imu.size(), 10U) << "steps of 10 ms";
  const ImuHistory old = imu_at_rest(50);
  peer_imu_ = &old;  // silent for more than half a second
  EXPECT_EQ(drain(600 + lag)->members.size(), 1U);
}

TEST_F(Intake, AnIntervalIsNeverLongerThanHalfASecond) {
  const auto interval = drain(5000);
  ASSERT_TRUE(interval);
  EXPECT_EQ(interval->to - interval->from, 500ms);
}

}  // namespace
}  // namespace crepes::team_intake_test
