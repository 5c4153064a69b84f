/// Distances by the sizes of rings in pictures.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "estimator/core/constants.hpp"
#include "estimator/vision/spot_detector.hpp"
#include "estimator/vision/tracking/camera_view.hpp"
#include "tests/estimator/vision/blink_tracker_fixture.hpp"
#include "tests/estimator/vision/detector_pictures.hpp"
#include "tests/support/ring_scene.hpp"

namespace crepes::ring_size_test {
namespace {

using test::BlinkTrackerTest;
using test::RingBoard;
using test::RingScene;
using test::small_fisheye;

/// Relative errors of the distances that single pictures give. `turn_rad`: the camera's axis is
/// that far from the board.
std::vector<double> distance_errors(const RingBoard& board, double range_m, double tilt_rad,
                                    double turn_rad = 0.0) {
  const CameraModel camera = small_fisheye();
  const CameraView view({}, camera);
  SpotDetector detector{VisionConfig{}};
  std::mt19937 random(7);
  std::vector<LightSighting> sightings;
  std::vector<double> errors;
  for (unsigned i = 0; i < 24; ++i) {
    RingScene scene(camera, {}, i);
    Pose T_C_M = test::random_board(random, range_m, tilt_rad);
    const Eigen::Quaterniond turn = so3_exp({0.0, turn_rad, 0.0});
    T_C_M = {turn * T_C_M.p, turn * T_C_M.q};
    scene.add_ring(T_C_M, board);
    const Detection found = detector.detect(scene.read());
    if (found.spots.size() != 1) continue;
    (void)view.unproject({.spots = {found.spots[0]}}, {}, {}, 1, sightings);
    if (sightings.at(0).ring_leds == board.leds)
      errors.push_back(board.radius_m / sightings[0].ring_tan / T_C_M.p.norm() - 1.0);
  }
  return errors;
}

TEST(RingSize, GivesTheDistanceOfBoardsOfAnyMakeAndTilt) {
  for (const int leds : {4, 5, 6, 8, 12}) {
    for (const double tilt_deg : {0.0, 30.0, 60.0}) {
      if (leds > 8 && tilt_deg > 45.0) continue;  // they touch each other
      const RingBoard board{.leds = leds, .radius_m = 0.03};
      const auto errors = distance_errors(board, 0.7, radians(tilt_deg));
      SCOPED_TRACE(std::to_string(leds) + " LEDs, " + std::to_string(tilt_deg) + " deg");
      ASSERT_GE(errors.size(), 18U);
      for (const double error : errors) EXPECT_LT(std::abs(error), 0.03);
    }
  }
}

// A lens of 185 degrees scales its rim otherwise than its middle, along it otherwise than across.
TEST(RingSize, IsRightOffTheAxis) {
  for (const double turn_deg : {10.0, 20.0}) {
    const auto errors = distance_errors({.leds = 8, .radius_m = 0.03}, 0.6, 0.0, radians(turn_deg));
    ASSERT_GE(errors.size(), 8U) << turn_deg;  // of those that the picture has
    for (const double error : errors) EXPECT_LT(std::abs(error), 0.03) << turn_deg;
  }
}

TEST(RingSize, IsUnknownWhereItIsNoNumberOrNoEllipse) {
  const CameraView view({}, small_fisheye());
  std::vector<LightSighting> sightings;
  for (const double bad : {std::nan(""), 0.0, std::numeric_limits<double>::infinity()}) {
    Spot spot{.u_px = 240.0, .v_px = 190.0, .area_px2 = 20.0, .peak = 200.0};
    spot.ring = {.leds = 6, .uu_px2 = bad, .uv_px2 = 0.0, .vv_px2 = bad, .sigma = 0.01};
    EXPECT_EQ(view.unproject({.spots = {spot}}, {}, {}, 1, sightings), 0U);
    EXPECT_EQ(sightings.at(0).ring_leds, 0) << bad;
  }
}

TEST(RingSize, IsUnknownWhereLedsLedsAreOneLight) {
  EXPECT_TRUE(distance_errors({.leds = 6, .radius_m = 0.03}, 4.0, 0.0).empty());
}

/// A board whose light has a size.
class SizedBoard : public BlinkTrackerTest {
 protected:
  /// The distances of a tracker that knows the board's radius, or not.
  static std::vector<Bearing> distances(std::optional<double> radius_m,
                                        std::optional<int> leds = {}, int seen_leds = 6) {
    SwarmConfig swarm = BlinkTrackerTest::swarm();
    swarm.members[0].ring_radius_m = radius_m;
    swarm.members[0].ring_leds = leds;
    const IdLibrary library = IdLibrary::from(swarm).value();
    BlinkTracker tracker(camera(), CameraModel::from(camera()).value(), VisionConfig{}, library);
    std::vector<Bearing> bearings;
    for (Duration t{}; t < std::chrono::seconds{1}; t += std::chrono::milliseconds{5}) {
      SpotFrame frame;
      frame.stamp = Timestamp{t};
      if (library.entries()[0].code.is_lit(t)) {
        frame.spots.push_back(
            {638.2, 512.5, 12.0, 255.0, 1.0, {seen_leds, 100.0, 0.0, 50.0, 0.01}});
      }
      for (const Bearing& bearing : tracker.step(frame)) bearings.push_back(bearing);
    }
    return bearings;
  }
};

TEST_F(SizedBoard, HasADistanceIfItsRadiusIsKnown) {
  CameraModel::UnprojectionJacobian J;
  ASSERT_TRUE(CameraModel::from(camera())->unproject({638.2, 512.5}, &J));
  const double expected_m = 0.03 / (10.0 * J.col(0).norm());

  const std::vector<Bearing> bearings = distances(0.03);

  ASSERT_GT(bearings.size(), 20U);
  for (const Bearing& bearing : bearings) {
    EXPECT_NEAR(bearing.distance_m, expected_m, 1e-6);
    EXPECT_NEAR(bearing.distance_sigma_m, 0.01 * expected_m, 1e-9);
  }
}

TEST_F(SizedBoard, HasNoneIfItsRadiusIsUnknown) {
  const std::vector<Bearing> bearings = distances(std::nullopt);
  ASSERT_GT(bearings.size(), 20U);
  for (const Bearing& bearing : bearings) EXPECT_EQ(bearing.distance_m, 0.0);
}

// LEDs may be hidden, or be one light with others.
TEST_F(SizedBoard, HasNoneByARingThatMayBeAPartOfIt) {
  EXPECT_EQ(distances(0.03, std::nullopt, 4).back().distance_m, 0.0);
  EXPECT_EQ(distances(0.03, 8, 6).back().distance_m, 0.0);
  EXPECT_GT(distances(0.03, 4, 4).back().distance_m, 0.0);
  EXPECT_GT(distances(0.03, 8, 8).back().distance_m, 0.0);
}

}  // namespace
}  // namespace crepes::ring_size_test
