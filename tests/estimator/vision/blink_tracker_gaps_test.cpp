/// Boards that were out of sight for a while: which light is named when it is seen again.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "estimator/vision/blink_tracker.hpp"
#include "tests/estimator/vision/blink_tracker_fixture.hpp"
#include "tests/support/heap.hpp"

namespace crepes::blink_tracker_gaps_test {
namespace {

using namespace std::chrono_literals;
using test::BlinkTrackerTest;

TEST_F(BlinkTrackerTest, KeepsIdsWhileFramesAreLost) {
  yaw_rate_radps_ = 0.5;
  boards_ = {{0, [](double t) { return Eigen::Vector3d(5.0, 0.5 * t, 0.3); }},
             {1, [](double t) { return Eigen::Vector3d(5.0, 2.0 + 0.5 * t, 0.3); }}};
  for (int i = 0; i < 100; ++i) (void)step();
  std::size_t named = 0;
  std::size_t lit = 0;
  for (int i = 0; i < 300; ++i) {
    const bool is_lost = i % 60 < 18;  // 90 ms
    const auto bearings = step(is_lost);
    if (is_lost) continue;
    named += bearings.size();
    lit += frame_.spots.size();
    for (const Bearing& bearing : bearings)
      EXPECT_LT(error_of(bearing, bearing.neighbor.value - 1U), 0.005);
  }

  EXPECT_GE(static_cast<double>(named), 0.9 * static_cast<double>(lit));
  EXPECT_EQ(tracker_.status().lost_ids, 0U);
}

TEST_F(BlinkTrackerTest, NamesABoardInItsFirstFrameAfterAGapThatTheGyroCarries) {
  for (const Duration gap : {400ms, 490ms}) {
    tracker_ = BlinkTracker(camera_, model_, VisionConfig{}, library_);
    yaw_rate_radps_ = 0.05;
    const double begin = to_seconds(now_.time_since_epoch()) - 100.0;
    const auto shown = [=](double t, double phase, const Eigen::Vector3d& p) {
      const double within = std::fmod(t - begin + phase, 1.2);
      return t - begin > 1.0 && within < to_seconds(gap) ? Eigen::Vector3d(-5.0, 0.0, 0.0) : p;
    };
    boards_ = {{0,
                [=](double t) {
                  return shown(t, 0.0, {5.0, 0.2 * (t - begin), 0.3});
                }},
               {1, [=](double t) {
                  return shown(t, 0.5, {5.0, 2.0 + 0.2 * (t - begin), 0.3});
                }}};
    std::size_t lit = 0;
    std::size_t predicted = 0;
    std::size_t read = 0;
    std::size_t confirmed = 0;
    for (int i = 0; i < 1200; ++i) {
      const auto bearings = step();
      if (i < 200) continue;
      lit += frame_.spots.size();
      confirmed += tracker_.confirmed().size();
      for (const Bearing& bearing : bearings) {
        ASSERT_LT(error_of(bearing, bearing.neighbor.value - 1U), 0.005) << "frame " << i;
        ++(bearing.how == Naming::kRead ? read : predicted);
      }
    }
    EXPECT_GE(static_cast<double>(read + predicted), 0.97 * static_cast<double>(lit));
    EXPECT_GT(predicted, 20U) << "they are marked";
    EXPECT_LT(predicted, lit / 4);
    EXPECT_NEAR(static_cast<double>(confirmed), static_cast<double>(predicted), 15.0);
    EXPECT_EQ(tracker_.status().lost_ids, 0U);
    EXPECT_EQ(tracker_.status().predicted_ids.unconfirmed, 0U);
  }
}

/// Board 1 flies 3 m while it is hidden for four seconds: the gyro does not know.
Eigen::Vector3d hidden_for_four_seconds(double t) {
  return t > 1.0 && t < 5.0 ? Eigen::Vector3d(-5.0, 0.0, 0.0)
                            : Eigen::Vector3d(5.0, t < 1.0 ? -1.5 : 1.5, 0.0);
}

TEST_F(BlinkTrackerTest, NamesABoardWhereAPoseExpectsIt) {
  for (const bool has_pose : {true, false}) {
    now_ = Timestamp{100s};
    tracker_ = BlinkTracker(camera_, model_, VisionConfig{}, library_);
    boards_ = {{0, hidden_for_four_seconds}};
    int to_name = 0;  // frames with light
    bool was_predicted = false;
    while (now_ < Timestamp{106s}) {
      expected_.clear();
      if (has_pose && now_ > Timestamp{105s}) expected_ = {pose_of(0)};
      const auto bearings = step();
      if (now_ < Timestamp{105s}) continue;
      if (bearings.empty() && !frame_.spots.empty()) ++to_name;
      if (bearings.empty()) continue;
      was_predicted = bearings[0].how == Naming::kPredicted;
      break;
    }
    EXPECT_EQ(was_predicted, has_pose);
    EXPECT_LE(to_name, has_pose ? 0 : 60);
    EXPECT_GE(to_name, has_pose ? 0 : 10);
  }
}

TEST_F(BlinkTrackerTest, KeepsNoMoreOfABoardThatComesBackByItsPoseAgainAndAgain) {
  boards_ = {{0, [](double t) {
                return std::fmod(t, 5.0) < 1.0 ? Eigen::Vector3d(5.0, 0.0, 0.0)
                                               : Eigen::Vector3d(-5.0, 0.0, 0.0);
              }}};
  std::int64_t before = 0;
  for (const Timestamp end = now_ + 60s; now_ < end;) {
    expected_ = {pose_of(0)};
    (void)step();
    if (now_ == end - 45s) before = test::heap_bytes();
  }

  EXPECT_LT(test::heap_bytes() - before, 50'000);
}

TEST_F(BlinkTrackerTest, DoesNotNameALightWhereThePoseExpectsNone) {
  const auto predicted_of = [&](std::vector<Board> boards, const Eigen::Vector3d& pose_off) {
    now_ = Timestamp{100s};
    tracker_ = BlinkTracker(camera_, model_, VisionConfig{}, library_);
    boards_ = std::move(boards);
    std::size_t predicted = 0;
    while (now_ < Timestamp{107s}) {
      expected_ = {pose_of(0)};
      expected_[0].p_B_M =
          Eigen::Vector3d(5.0, now_ < Timestamp{101s} ? -1.5 : 1.5, 0.0) + pose_off;
      for (const Bearing& bearing : step()) predicted += bearing.how == Naming::kPredicted ? 1 : 0;
    }
    return predicted;
  };
  const Board board{0, hidden_for_four_seconds};
  const Board lamp{3, [](double t) {  // from second 2 on
                     return Eigen::Vector3d(t < 2.0 ? -5.0 : 5.0, 1.55, 0.02);
                   }};

  EXPECT_GT(predicted_of({board}, Eigen::Vector3d::Zero()), 5U);
  EXPECT_EQ(predicted_of({board}, {0.0, 0.3, 0.0}), 0U) << "far from its gate";
  EXPECT_LT(predicted_of({board, lamp}, Eigen::Vector3d::Zero()), 40U)
      << "a lamp is named until the board would be dark, and the board beside it is not";
  EXPECT_GE(tracker_.status().predicted_ids.unconfirmed, 1U);
}

TEST_F(BlinkTrackerTest, DoesNotTakeALightBesideTheExpectedPlaceForTheBoardThatWasHidden) {
  // Board 2 appears 10 px beside the place where board 1 was 90 ms before.
  boards_ = {{0, [](double t) { return Eigen::Vector3d(t < 1.0 ? 5.0 : -5.0, 0.0, 0.0); }},
             {1, [](double t) { return Eigen::Vector3d(t < 1.09 ? -5.0 : 5.0, 0.16, 0.0); }}};
  for (int i = 0; i < 400; ++i)
    for (const Bearing& bearing : step())
      ASSERT_LT(error_of(bearing, bearing.neighbor.value - 1U), 0.005) << "frame " << i;
}

TEST_F(BlinkTrackerTest, RecognizesInGlimpsesWhatItHasSeenBefore) {
  // Each board shows itself for 144 ms, 0.8 of its pattern, and is hidden for 756 ms; the camera
  // turns, and they move.
  yaw_rate_radps_ = 0.1;
  const auto glimpsed = [](double t, double phase, const Eigen::Vector3d& p) {
    const double turns = t / 0.9 + phase;
    return turns - std::floor(turns) < 0.16 ? p : Eigen::Vector3d(-5.0, 0.0, 0.0);
  };
  boards_ = {{0,
              [&](double t) {
                return glimpsed(t, 0.0, {5.0, 0.6 * t, 0.3});
              }},
             {1, [&](double t) {
                return glimpsed(t, 0.4, {5.0, 0.6 * t + 3.0, 0.3});
              }}};
  std::size_t named = 0;
  std::size_t lit = 0;
  for (int i = 0; i < 1400; ++i) {
    const auto bearings = step();
    lit += frame_.spots.size();
    named += bearings.size();
    for (const Bearing& bearing : bearings)
      ASSERT_LT(error_of(bearing, bearing.neighbor.value - 1U), 0.005) << "frame " << i;
  }

  EXPECT_GT(static_cast<double>(named), 0.15 * static_cast<double>(lit));
}

TEST_F(BlinkTrackerTest, DoesNotTakeANewBoardForTheOneThatWasHiddenThere) {
  for (int trial = 0; trial < 60; ++trial) {
    tracker_ = BlinkTracker(camera_, model_, VisionConfig{}, library_);
    const double begin = to_seconds(now_.time_since_epoch()) - 100.0;
    const double shows = begin + 1.8 + 0.013 * trial;
    const auto shown = [](bool is_shown) {
      return Eigen::Vector3d(is_shown ? 5.0 : -5.0, 0.0, 0.0);
    };
    boards_ = {{0, [=](double t) { return shown(t < begin + 1.0); }},
               {1, [=](double t) { return shown(t >= shows); }}};
    int seen = 0;
    for (int i = 0; i < 900; ++i)
      for (const Bearing& bearing : step()) {
        ASSERT_LT(error_of(bearing, bearing.neighbor.value - 1U), 0.005) << "trial " << trial;
        seen += bearing.neighbor == RobotId{2} ? 1 : 0;
      }
    EXPECT_GT(seen, 150);
  }
}

}  // namespace
}  // namespace crepes::blink_tracker_gaps_test
