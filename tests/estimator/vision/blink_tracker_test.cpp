#include "estimator/vision/blink_tracker.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "tests/estimator/vision/blink_tracker_fixture.hpp"

namespace crepes::blink_tracker_test {
namespace {

using namespace std::chrono_literals;
using test::BlinkTrackerTest;

TEST_F(BlinkTrackerTest, GivesBearingsInBodyAxesAndBodyTime) {
  boards_ = {{0, [](double) { return Eigen::Vector3d(5.0, 1.0, 0.3); }}};
  for (int i = 0; i < 100; ++i) (void)step();

  std::vector<Bearing> bearings;
  while (bearings.empty()) bearings = step();

  ASSERT_EQ(bearings.size(), 1U);
  EXPECT_EQ(bearings[0].neighbor, RobotId{1});
  EXPECT_EQ(bearings[0].stamp, now_ + 2ms);
  EXPECT_LT((bearings[0].p_B_C - Eigen::Vector3d(0.06, 0.0, 0.01)).norm(), 1e-12);
  EXPECT_LT(error_of(bearings[0], 0), 5.0 * bearings[0].sigma_rad);
  EXPECT_NEAR(bearings[0].sigma_rad, 0.3 / 317.0, 0.4 / 317.0);
}

TEST_F(BlinkTrackerTest, ASpotThatJittersMoreThanConfiguredHasALargerSigma) {
  boards_ = {{0, [](double) { return Eigen::Vector3d(5.0, 1.0, 0.3); }}};
  const auto sigma_rad = [&](double jitter_px) {
    jitter_px_ = jitter_px;
    double last = 0.0;
    for (int i = 0; i < 600; ++i)
      for (const Bearing& bearing : step()) last = bearing.sigma_rad;
    return last;
  };

  const double as_configured = sigma_rad(0.1);

  EXPECT_NEAR(sigma_rad(0.5), 2.5 * as_configured, 0.5 * as_configured);
  EXPECT_NEAR(sigma_rad(0.1), as_configured, 0.01 * as_configured);
}

TEST_F(BlinkTrackerTest, KeepsItsBoardsWhileItTurnsFiveHundredDegreesASecond) {
  yaw_rate_radps_ = 500.0 / 57.29578;
  boards_ = {{0, [](double t) {  // an orbiting board stays in view
                const double a = 500.0 / 57.29578 * t;
                return Eigen::Vector3d(5.0 * std::cos(a), 5.0 * std::sin(a), 0.0);
              }}};
  for (int i = 0; i < 200; ++i) (void)step();
  // The same turn with boards that stand: in view for a sixth of a second or so at a time.
  boards_ = {{0, [](double) { return Eigen::Vector3d(5.0, 0.0, 0.0); }},
             {1, [](double) { return Eigen::Vector3d(0.0, 5.0, 1.0); }},
             {2, [](double) { return Eigen::Vector3d(-5.0, 0.0, -1.0); }}};

  int right = 0;
  for (int i = 0; i < 1200; ++i)
    for (const Bearing& bearing : step()) {
      const double error = error_of(bearing, bearing.neighbor.value - 1U);
      ASSERT_LT(error, 0.01);
      ++right;
    }

  EXPECT_GT(right, 100);
}

TEST_F(BlinkTrackerTest, DistinguishesCrossingBoards) {
  boards_ = {{0, [](double t) { return Eigen::Vector3d(5.0, -2.0 + 0.8 * t, 0.0); }},
             {1, [](double t) { return Eigen::Vector3d(5.0, 2.0 - 0.8 * t, 0.02); }}};
  int right = 0;
  for (int i = 0; i < 1000; ++i)
    for (const Bearing& bearing : step()) {
      ASSERT_LT(error_of(bearing, bearing.neighbor.value - 1U), 0.015) << "frame " << i;
      ++right;
    }

  EXPECT_GT(right, 1000);
  EXPECT_GT(tracker_.status().merged_spots, 0U);
}

TEST_F(BlinkTrackerTest, DeliversAMirrorImageBesideTheBoardItself) {
  boards_ = {{0, [](double) { return Eigen::Vector3d(5.0, 0.0, 0.5); }},
             {0, [](double) { return Eigen::Vector3d(5.0, 0.0, -2.0); }}};
  for (int i = 0; i < 200; ++i) (void)step();

  int both = 0;
  for (int i = 0; i < 100; ++i) both += step().size() == 2U ? 1 : 0;

  EXPECT_GT(both, 30);
}

TEST_F(BlinkTrackerTest, FindsRobotsAmongTwoHundredLamps) {
  boards_ = {{0, [](double t) { return Eigen::Vector3d(4.0, std::sin(t), 0.4); }},
             {1, [](double t) { return Eigen::Vector3d(3.0, 2.0, 0.3 * std::cos(t)); }}};
  for (int i = 0; i < 190; ++i) {
    const Eigen::Vector3d p(4.0, -4.5 + 0.5 * (i % 19), -2.5 + 0.6 * (i / 19));
    boards_.push_back({3, [p](double) { return p; }});
  }
  int right = 0;
  for (int i = 0; i < 400; ++i)
    for (const Bearing& bearing : step()) {
      ASSERT_LE(bearing.neighbor.value, 2);
      ASSERT_LT(error_of(bearing, bearing.neighbor.value - 1U), 0.02);
      ++right;
    }

  EXPECT_GT(right, 300);
  EXPECT_LE(tracker_.status().tracks, 512U);
}

TEST_F(BlinkTrackerTest, DoesNotCareForTheOrderOfSpots) {
  BlinkTracker twin(camera_, model_, VisionConfig{}, library_);
  boards_ = {{0, [](double t) { return Eigen::Vector3d(5.0, -1.0 + t, 0.0); }},
             {1, [](double t) { return Eigen::Vector3d(5.0, 1.0 - t, 0.1); }},
             {2, [](double) { return Eigen::Vector3d(5.0, 0.0, 0.5); }}};
  for (int i = 0; i < 500; ++i) {
    const std::vector<Bearing> bearings = step();
    std::reverse(frame_.spots.begin(), frame_.spots.end());
    ImuSample imu;
    imu.stamp = now_ + 2ms;
    twin.add_imu(imu);
    const std::vector<Bearing> mirrored = twin.step(frame_);

    ASSERT_EQ(bearings.size(), mirrored.size());
    for (std::size_t k = 0; k < bearings.size(); ++k) {
      ASSERT_EQ(bearings[k].neighbor, mirrored[k].neighbor);
      ASSERT_EQ(bearings[k].u_B, mirrored[k].u_B);
    }
  }
}

TEST_F(BlinkTrackerTest, RefusesAndCountsWhatMakesNoSense) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  SpotFrame frame;
  frame.stamp = now_;
  frame.spots = {{kNan, 10.0, 5.0, 255.0}, {640.0, 512.0, kNan, 255.0}, {1e9, 0.0, 5.0, 255.0}};
  ImuSample imu;
  imu.stamp = now_;
  imu.gyro_radps.x() = kNan;

  (void)tracker_.step(frame);
  (void)tracker_.step(frame);
  tracker_.add_imu(imu);

  const TrackerStatus status = tracker_.status();
  EXPECT_EQ(status.refused_spots, 3U);
  EXPECT_EQ(status.refused_frames, 1U);
  EXPECT_EQ(status.refused_imu, 1U);
  EXPECT_EQ(status.tracks, 0U);
}

}  // namespace
}  // namespace crepes::blink_tracker_test
