#include "estimator/swarm/report_composer.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace crepes::report_composer_test {
namespace {

using namespace std::chrono_literals;

Bearing bearing_at(Duration t, RobotId neighbor = RobotId{2}) {
  Bearing bearing;
  bearing.stamp = Timestamp{t};
  bearing.neighbor = neighbor;
  return bearing;
}

UwbRange range_at(Duration t) {
  UwbRange range;
  range.stamp = Timestamp{t};
  range.neighbor = RobotId{2};
  range.range_m = 3.0;
  return range;
}

RobotState state_with_imu(int samples) {
  RobotState state;
  for (int i = 1; i <= samples; ++i) {
    state.imu.push({Timestamp{i * 10ms}, Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ()});
  }
  state.tilt = Tilt{.stamp = Timestamp{samples * 10ms}};
  return state;
}

TEST(ReportComposer, SaysNothingBeforeThereIsATilt) {
  ReportComposer composer(RobotId{1});
  composer.add(bearing_at(10ms));

  EXPECT_FALSE(composer.compose(Timestamp{20ms}, RobotState{}, {}));
}

TEST(ReportComposer, RepeatsTheLast520Milliseconds) {
  ReportComposer composer(RobotId{1});
  const RobotState state = state_with_imu(60);
  composer.add(range_at(100ms));
  composer.add(bearing_at(105ms));

  for (const Duration now : {Duration{120ms}, Duration{200ms}, Duration{620ms}}) {
    const auto report = composer.compose(Timestamp{now}, state, {});
    ASSERT_TRUE(report);
    EXPECT_EQ(report->ranges.size(), 1U);
    EXPECT_EQ(report->bearings.size(), 1U);
    EXPECT_EQ(report->sender, RobotId{1});
    EXPECT_EQ(report->stamp, Timestamp{now});
  }
  const auto later = composer.compose(Timestamp{626ms}, state, {});
  EXPECT_TRUE(later->ranges.empty());
  EXPECT_TRUE(later->bearings.empty());
}

TEST(ReportComposer, RepeatsImuSamplesOfTheSameTime) {
  ReportComposer composer(RobotId{1});

  const auto report = composer.compose(Timestamp{600ms}, state_with_imu(60), {});

  ASSERT_FALSE(report->imu.empty());
  EXPECT_EQ(report->imu.front().stamp, Timestamp{80ms});
  EXPECT_EQ(report->imu.back().stamp, Timestamp{600ms});
}

TEST(ReportComposer, ThinsBearingsToTheNewestFrameOfEachNeighbor) {
  ReportComposer composer(RobotId{1});
  for (int i = 1; i <= 4; ++i) composer.add(bearing_at(i * 5ms, RobotId{2}));
  for (int i = 1; i <= 4; ++i) composer.add(bearing_at(i * 5ms - 1ms, RobotId{3}));

  const auto report = composer.compose(Timestamp{20ms}, state_with_imu(2), {});

  ASSERT_EQ(report->bearings.size(), 2U);
  EXPECT_EQ(report->bearings[0].stamp, Timestamp{20ms});
  EXPECT_EQ(report->bearings[1].stamp, Timestamp{19ms});
}

TEST(ReportComposer, KeepsBothBearingsOfAFrameThatShowsANeighborTwice) {
  ReportComposer composer(RobotId{1});
  composer.add(bearing_at(5ms));
  composer.add(bearing_at(10ms));
  composer.add(bearing_at(10ms));

  const auto report = composer.compose(Timestamp{20ms}, state_with_imu(2), {});

  EXPECT_EQ(report->bearings.size(), 2U);
}

TEST(ReportComposer, StaysBoundedWhileThereIsNoTilt) {
  ReportComposer composer(RobotId{1});
  for (int i = 0; i < 10000; ++i) {
    composer.add(range_at(i * 10ms));
    composer.add(bearing_at(i * 10ms));
    static_cast<void>(composer.compose(Timestamp{i * 10ms}, RobotState{}, {}));
  }

  const auto report = composer.compose(Timestamp{99990ms}, state_with_imu(2), {});

  EXPECT_LE(report->ranges.size(), 53U);
  EXPECT_LE(report->bearings.size(), 53U);
}

TEST(ReportComposer, ReportsSpikesAmongTheSamples) {
  ReportComposer composer(RobotId{1});
  RobotState state = state_with_imu(0);
  state.tilt = Tilt{.stamp = Timestamp{1200ms}};
  for (int i = 1; i <= 120; ++i) {
    ImuSample sample{Timestamp{i * 10ms}, Eigen::Vector3d::Constant(1e-4 * (i % 7)),
                     Eigen::Vector3d{1e-3 * (i % 5), 0.0, 9.81}};
    if (i == 40 || i == 100) sample.accel_mps2.x() = -40.0;
    for (const ImuSample& believed : state.guard.accept(sample)) state.add_believed(believed);
  }
  ASSERT_EQ(state.imu.size(), 120U);
  EXPECT_EQ(state.imu[99].accel_mps2, state.imu[98].accel_mps2);  // its rate is kept alone

  const auto report = composer.compose(Timestamp{1200ms}, state, {});

  ASSERT_EQ(report->imu.size(), 53U);  // from 680 ms on: the first spike is too old
  EXPECT_TRUE(std::ranges::is_sorted(report->imu, {}, &ImuSample::stamp));
  EXPECT_EQ(report->imu[32].stamp, Timestamp{1000ms});
  EXPECT_EQ(report->imu[32].accel_mps2.x(), -40.0);
}

}  // namespace
}  // namespace crepes::report_composer_test
