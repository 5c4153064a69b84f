#include "estimator/vision/spot_detector.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <Eigen/Core>
#include <cmath>
#include <random>

#include "tests/estimator/vision/detector_pictures.hpp"
#include "tests/support/ring_scene.hpp"

namespace crepes::spot_detector_test {
namespace {

using test::facing_board;
using test::kPixelsPerRadian;
using test::off;
using test::picture;
using test::RingBoard;
using test::RingScene;
using test::small_fisheye;

TEST(SpotDetector, KeepsTwoBoardsSideBySideApart) {
  const CameraModel camera = small_fisheye();
  SpotDetector detector{VisionConfig{}};
  for (const double range : {0.6, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 10.0, 20.0}) {
    const double radius_px = RingBoard{}.radius_m / range * kPixelsPerRadian;
    const double apart = 2.0 * radius_px + 9.0;  // blur and 3 dark pixels between the boards
    RingScene scene(camera, {}, 7);
    const Eigen::Vector2d left(160.0 - apart / 2.0, 120.3);
    const Eigen::Vector2d right(160.0 + apart / 2.0, 120.3);
    scene.add_ring(facing_board(camera, left, range));
    scene.add_ring(facing_board(camera, right, range));

    const Detection found = detector.detect(scene.read());

    ASSERT_EQ(found.spots.size(), 2U) << range << " m";
    const bool is_swapped = found.spots[0].u_px > 160.0;
    EXPECT_LT(off(found.spots[is_swapped ? 1 : 0], left), 0.35) << range << " m";
    EXPECT_LT(off(found.spots[is_swapped ? 0 : 1], right), 0.35) << range << " m";
  }
}

TEST(SpotDetector, KeepsThreeDistantBoardsInAWedgeApart) {
  const CameraModel camera = small_fisheye();
  RingScene scene(camera, {}, 7);
  scene.add_ring(facing_board(camera, {140.0, 120.0}, 12.0));
  scene.add_ring(facing_board(camera, {155.0, 128.0}, 12.0));
  scene.add_ring(facing_board(camera, {170.0, 120.0}, 12.0));
  SpotDetector detector{VisionConfig{}};

  EXPECT_EQ(detector.detect(scene.read()).spots.size(), 3U);
}

TEST(SpotDetector, LeavesOutHotPixelsBesideAFaintBoard) {
  const CameraModel camera = small_fisheye();
  RingScene scene(camera, {}, 3);
  const Eigen::Vector2d board = scene.add_ring(facing_board(camera, {100.4, 90.7}, 27.0));
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i)
    scene.set_pixel(static_cast<int>(10 + random() % 150 * 2),
                    static_cast<int>(120 + random() % 60 * 2),
                    60.0 + static_cast<double>(random() % 300));
  SpotDetector detector{VisionConfig{}};

  const Detection found = detector.detect(scene.read());

  ASSERT_EQ(found.spots.size(), 1U);
  EXPECT_LT(off(found.spots[0], board), 0.4);
  EXPECT_GT(found.rejected.hot, 150U);
}

TEST(SpotDetector, FindsBoardsBesideASunThatFillsMostOfThePicture) {
  const CameraModel camera = small_fisheye();
  SpotDetector detector{VisionConfig{}};
  for (const double radius : {30.0, 90.0, 150.0}) {
    RingScene scene(camera, {}, 3);
    scene.add_disc({300.0, 200.0}, radius, 3000.0);
    const Eigen::Vector2d near = scene.add_ring(facing_board(camera, {40.3, 60.2}, 1.0));
    const Eigen::Vector2d far = scene.add_ring(facing_board(camera, {90.6, 30.9}, 15.0));
    VisionConfig config;
    config.max_area_px2 = 2500.0;
    detector = SpotDetector(config);

    const Detection found = detector.detect(scene.read());

    ASSERT_EQ(found.spots.size(), 2U) << radius;
    EXPECT_LT(off(found.spots[0], near), 0.1) << radius;
    EXPECT_LT(off(found.spots[1], far), 0.3) << radius;
    EXPECT_EQ(found.rejected.huge, 1U) << radius;
    EXPECT_EQ(found.exposure, radius > 100.0 ? Exposure::kBright : Exposure::kGood) << radius;
  }
}

TEST(SpotDetector, FindsBoardsInFrontOfABrightWallAndBesideIt) {
  const CameraModel camera = small_fisheye();
  RingScene scene(camera, {}, 3);
  for (int v = 0; v < 256; ++v)
    for (int u = 140; u < 320; ++u) scene.at(u, v) = 120.0F;
  const Eigen::Vector2d before = scene.add_ring(facing_board(camera, {250.3, 150.2}, 5.0));
  const Eigen::Vector2d beside = scene.add_ring(facing_board(camera, {60.6, 90.9}, 15.0));
  SpotDetector detector{VisionConfig{}};

  const Detection found = detector.detect(scene.read());

  ASSERT_EQ(found.spots.size(), 2U);
  EXPECT_LT(off(found.spots[0], before), 0.2);
  EXPECT_LT(off(found.spots[1], beside), 0.3);
}

TEST(SpotDetector, TakesTheGrainOfAGlowForNoSpots) {
  const CameraModel camera = small_fisheye();
  RingScene scene(camera, {.read_noise = 3.0}, 3);
  for (int v = 0; v < 256; ++v)
    for (int u = 0; u < 320; ++u) scene.at(u, v) = 90.0F * static_cast<float>(u) / 320.0F;
  const Eigen::Vector2d board = scene.add_ring(facing_board(camera, {60.3, 150.2}, 2.0));
  SpotDetector detector{VisionConfig{}};

  const Detection found = detector.detect(scene.read());

  ASSERT_EQ(found.spots.size(), 1U);
  EXPECT_LT(off(found.spots[0], board), 0.3);
}

TEST(SpotDetector, MeasuresHowLongASpotIs) {
  RingScene scene(small_fisheye(), {}, 3);
  for (int i = 0; i < 20; ++i) scene.add_point({100.0 + i, 100.0 + i}, 300.0);
  scene.add_point({250.0, 200.0}, 3000.0);
  SpotDetector detector{VisionConfig{}};

  const Detection found = detector.detect(scene.read());

  ASSERT_EQ(found.spots.size(), 2U);
  const Spot& streak = found.spots[0].u_px < 200.0 ? found.spots[0] : found.spots[1];
  const Spot& round = found.spots[0].u_px < 200.0 ? found.spots[1] : found.spots[0];
  EXPECT_GT(streak.elongation, 3.0);
  EXPECT_LT(round.elongation, 1.1);
}

TEST(SpotDetector, GivesNoCenterOfABoardThatTheBorderCuts) {
  const CameraModel camera = small_fisheye();
  for (const double range : {2.0, 5.0}) {
    for (const double v : {-1.0, 0.0, 1.5}) {
      RingScene scene(camera, {}, 5);
      scene.add_ring(facing_board(camera, {160.0, v}, range));
      const Eigen::Vector2d whole = scene.add_ring(facing_board(camera, {160.0, 60.0}, range));
      SpotDetector detector{VisionConfig{}};

      const Detection found = detector.detect(scene.read());

      ASSERT_EQ(found.spots.size(), 1U) << range << " m, " << v;
      EXPECT_LT(off(found.spots[0], whole), 0.35);
      EXPECT_GE(found.rejected.cut, 1U);
    }
  }
}

TEST(SpotDetector, KeepsTheBrightestSpotsAndCountsTheOthers) {
  RingScene scene(small_fisheye(), {}, 3);
  for (int i = 0; i < 40; ++i)
    scene.add_point({20.0 + 28.0 * (i % 10), 40.0 + 50.0 * (i / 10)}, i < 35 ? 80.0 : 5000.0);
  VisionConfig config;
  config.max_spots = 5;
  SpotDetector detector{config};

  const Detection found = detector.detect(scene.read());

  ASSERT_EQ(found.spots.size(), 5U);
  EXPECT_EQ(found.rejected.surplus, 35U);
  for (const Spot& spot : found.spots) EXPECT_GT(spot.v_px, 180.0);
}

TEST(SpotDetector, SaysWhenAllIsDark) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(40.0, 3.0);
  const auto black = picture(640, 480, [](int, int) { return 0; });
  const auto gray = picture(640, 480, [&](int, int) { return noise(random); });
  SpotDetector detector{VisionConfig{}};

  EXPECT_EQ(detector.detect({black.data(), 640, 480, 640}).exposure, Exposure::kDark);
  EXPECT_EQ(detector.detect({gray.data(), 640, 480, 640}).exposure, Exposure::kDark);
}

TEST(SpotDetector, SaysWhenAllIsBright) {
  const auto white = picture(2048, 2048, [](int, int) { return 255; });
  const auto pale = picture(640, 480, [](int u, int v) { return 200 + (u * 7 + v * 3) % 5; });
  const auto striped = picture(640, 480, [](int u, int) { return u % 2 == 0 ? 255 : 0; });
  SpotDetector detector{VisionConfig{}};

  for (const Detection& found : {detector.detect({white.data(), 2048, 2048, 2048}),
                                 detector.detect({pale.data(), 640, 480, 640}),
                                 detector.detect({striped.data(), 640, 480, 640})}) {
    EXPECT_EQ(found.exposure, Exposure::kBright);
    EXPECT_TRUE(found.spots.empty());
  }
}

TEST(SpotDetector, SurvivesEveryNoiseAndEverySize) {
  EXPECT_TRUE(rc::check([] {
    const int width = *rc::gen::inRange(1, 200);
    const int height = *rc::gen::inRange(1, 100);
    const int chance = *rc::gen::inRange(1, 40);
    std::mt19937 random(static_cast<unsigned>(*rc::gen::inRange(0, 1 << 30)));
    const auto pixels = picture(width, height, [&](int, int) {
      return random() % 40U < unsigned(chance) / 4U ? random() % 256U : 0U;
    });
    VisionConfig config;
    config.threshold = *rc::gen::inRange(0, 256);
    config.max_area_px2 = *rc::gen::inRange(10, 1000);
    SpotDetector detector{config};

    const Detection found = detector.detect({pixels.data(), width, height, width});

    for (const Spot& spot : found.spots) {
      RC_ASSERT(spot.u_px > -0.5 * width && spot.u_px < 1.5 * width);
      RC_ASSERT(spot.v_px > -0.5 * height && spot.v_px < 1.5 * height);
      RC_ASSERT(spot.area_px2 >= config.min_area_px2);
      RC_ASSERT(std::isfinite(spot.elongation) && spot.elongation >= 1.0);
    }
  }));
}

TEST(SpotDetector, ReadsOnlyThePictureOfAWiderBuffer) {
  auto wide = picture(400, 50, [](int u, int) { return u < 300 ? 5 : 255; });
  wide[25 * 400 + 100] = wide[25 * 400 + 101] = wide[26 * 400 + 100] = 200;
  SpotDetector detector{VisionConfig{}};

  const Detection found = detector.detect({wide.data(), 300, 50, 400});

  ASSERT_EQ(found.spots.size(), 1U);
  EXPECT_LT(off(found.spots[0], {100.3, 25.3}), 0.1);
}

}  // namespace
}  // namespace crepes::spot_detector_test
