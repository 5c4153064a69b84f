#include "estimator/vision/spot_detector.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <random>

#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"
#include "tests/support/ring_scene.hpp"

namespace crepes::spot_detector_test {
namespace {

using test::Optics;
using test::random_board;
using test::RingBoard;
using test::RingScene;
using test::small_fisheye;

constexpr double kPixelsPerRadian = 382.0;  // of small_fisheye() at its center

double off(const Spot& spot, const Eigen::Vector2d& uv) {
  return (Eigen::Vector2d(spot.u_px, spot.v_px) - uv).norm();
}

/// A board facing the camera whose center appears at `uv`.
Pose facing_board(const CameraModel& camera, const Eigen::Vector2d& uv, double range_m) {
  const Eigen::Vector3d toward = camera.unproject(uv).value();
  return {range_m * toward, shortest_rotation(Eigen::Vector3d::UnitX(), -toward)};
}

struct Accuracy {
  int missed = 0;      ///< pictures without a spot, or with more than one
  double rms = 0.0;    ///< distance from the projected center [px]
  double worst = 0.0;  ///< the largest [px]
  double bias = 0.0;   ///< length of the mean offset [px]
};

Accuracy accuracy(double range_m, double tilt_rad, const Optics& optics,
                  const RingBoard& board = {}) {
  constexpr int kPictures = 24;
  const CameraModel camera = small_fisheye();
  SpotDetector detector{VisionConfig{}};
  std::mt19937 random(5);
  Accuracy result;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double squares = 0.0;
  for (unsigned i = 0; i < kPictures; ++i) {
    RingScene scene(camera, optics, i);
    const Eigen::Vector2d center = scene.add_ring(random_board(random, range_m, tilt_rad), board);
    const Detection found = detector.detect(scene.read());
    if (found.spots.size() != 1) {
      ++result.missed;
      continue;
    }
    const Eigen::Vector2d offset =
        Eigen::Vector2d(found.spots[0].u_px, found.spots[0].v_px) - center;
    sum += offset;
    squares += offset.squaredNorm();
    result.worst = std::max(result.worst, offset.norm());
  }
  const int seen = std::max(1, kPictures - result.missed);
  result.rms = std::sqrt(squares / seen);
  result.bias = sum.norm() / seen;
  return result;
}

/// Root mean square over ranges, each of which must show one spot in every picture.
double sweep_rms(const std::vector<double>& ranges_m, double tilt_rad, const Optics& optics) {
  double squares = 0.0;
  for (const double range : ranges_m) {
    const Accuracy at = accuracy(range, tilt_rad, optics);
    EXPECT_EQ(at.missed, 0) << range << " m";
    EXPECT_LT(at.worst, 0.4) << range << " m";
    squares += at.rms * at.rms;
  }
  return std::sqrt(squares / static_cast<double>(ranges_m.size()));
}

const std::vector<double> kToTenMeters{0.3, 0.45, 0.6, 0.8, 1.0, 1.3, 1.6, 2.0,
                                       2.4, 2.8,  3.3, 4.0, 5.0, 6.0, 7.5, 10.0};

class FromAngleAndExposure : public testing::TestWithParam<std::tuple<double, double>> {};

TEST_P(FromAngleAndExposure, ARingIsOneSpotWithinATenthOfAPixelToTenMeters) {
  const auto [tilt_deg, exposure] = GetParam();

  const double rms = sweep_rms(kToTenMeters, radians(tilt_deg), {.exposure = exposure});

  RecordProperty("rms_px", std::to_string(rms));
  EXPECT_LT(rms, 0.1);
}

INSTANTIATE_TEST_SUITE_P(SpotDetector, FromAngleAndExposure,
                         testing::Combine(testing::Values(0.0, 30.0, 45.0),
                                          testing::Values(0.35, 1.0, 4.0)));

TEST(SpotDetector, FindsABoardAt27MetersWithinAQuarterOfAPixel) {
  for (const double tilt_deg : {0.0, 30.0, 45.0}) {
    const Accuracy far = accuracy(27.0, radians(tilt_deg), {});

    EXPECT_EQ(far.missed, 0) << tilt_deg;
    EXPECT_LT(far.rms, 0.25) << tilt_deg;
    EXPECT_LT(far.bias, 0.08) << tilt_deg;  // 0.25 px over the root of 24 pictures, and a half more
  }
}

TEST(SpotDetector, FindsABoardAt30MetersOfTwoOrThreePixels) {
  EXPECT_EQ(accuracy(30.0, 0.0, {}).missed, 0);
}

TEST(SpotDetector, FindsTheSameCenterSharpAndBlurred) {
  for (const double blur : {0.6, 1.1}) {
    for (const double range : {0.5, 1.0, 2.0, 3.0, 5.0, 10.0}) {
      const Accuracy at = accuracy(range, 0.4, {.blur_px = blur});

      EXPECT_EQ(at.missed, 0) << range << " m, blur " << blur;
      EXPECT_LT(at.rms, 0.15) << range << " m, blur " << blur;
    }
  }
}

TEST(SpotDetector, IsNotBiasedBySaturation) {
  for (const double exposure : {1.0, 8.0, 30.0}) {
    for (const double range : {4.0, 10.0}) {
      const Accuracy at = accuracy(range, 0.5, {.exposure = exposure});

      EXPECT_EQ(at.missed, 0);
      EXPECT_LT(at.rms, 0.1) << range << " m, exposure " << exposure;
      EXPECT_LT(at.bias, 0.03) << range << " m, exposure " << exposure;
    }
  }
}

TEST(SpotDetector, CentersARingOfWhichLedsAreHiddenWhereTheyAreApart) {
  for (const unsigned hidden : {0b000001U, 0b000011U, 0b000111U}) {
    for (const double range : {0.6, 0.8, 1.0, 1.3}) {
      const Accuracy at = accuracy(range, 0.0, {}, {.hidden = hidden});

      EXPECT_EQ(at.missed, 0) << range << " m, hidden " << hidden;
      EXPECT_LT(at.worst, 0.4) << range << " m, hidden " << hidden;
    }
  }
}

TEST(SpotDetector, CentersHalfARingThatIsTurnedAway) {
  // Three points do not determine perspective, which is worth R^2/d^2 at the lens: 0.5 px at 0.7 m.
  for (const double range : {0.7, 0.9, 1.1}) {
    const Accuracy at = accuracy(range, radians(40.0), {}, {.hidden = 0b000111U});

    EXPECT_EQ(at.missed, 0) << range;
    EXPECT_LT(at.rms, 0.6) << range;
  }
}

// What one blob shows of half a ring is its own middle: two thirds of the radius away, 2 cm at any
// range. Nobody can know from one picture; the figure is documented.
TEST(SpotDetector, LeansByTwoThirdsOfTheRadiusWhenHalfOfAnUnresolvedRingIsHidden) {
  const RingBoard half{.hidden = 0b000111U};
  for (const double range : {5.0, 10.0, 20.0}) {
    const Accuracy at = accuracy(range, 0.0, {}, half);
    const double radius_px = half.radius_m / range * kPixelsPerRadian;

    EXPECT_EQ(at.missed, 0);
    EXPECT_NEAR(at.rms, 2.0 / 3.0 * radius_px, 0.12) << range;
  }
}

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

/// A picture whose pixel (u, v) is level(u, v).
template <class Level>
std::vector<std::uint8_t> picture(int width, int height, const Level& level) {
  std::vector<std::uint8_t> pixels;
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) pixels.push_back(static_cast<std::uint8_t>(level(u, v)));
  return pixels;
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

TEST(SpotDetector, OfThePaperFindsTheSameBoard) {
  const CameraModel camera = small_fisheye();
  RingScene scene(camera, {}, 3);
  const Eigen::Vector2d board = scene.add_ring(facing_board(camera, {150.0, 120.0}, 2.3));
  VisionConfig config;
  config.detector = SpotDetectorKind::kHough;
  SpotDetector detector{config};

  const Detection found = detector.detect(scene.read());

  ASSERT_EQ(found.spots.size(), 1U);
  EXPECT_LT(off(found.spots[0], board), 1.0);
  EXPECT_TRUE(found.failure.empty());
}

TEST(SpotDetector, OfThePaperFindsAllOfManySmallBoards) {
  const CameraModel camera = small_fisheye();
  RingScene scene(camera, {}, 4);
  std::vector<Eigen::Vector2d> boards;
  for (const double range_m : {2.0, 3.0, 4.5, 6.0}) {
    const Eigen::Vector2d at(40.0 * range_m, 30.0 + 30.0 * range_m);
    boards.push_back(scene.add_ring(facing_board(camera, at, range_m)));
  }
  VisionConfig config;
  config.detector = SpotDetectorKind::kHough;
  SpotDetector detector{config};

  const Detection found = detector.detect(scene.read());

  EXPECT_EQ(found.spots.size(), boards.size());
  for (const Eigen::Vector2d& board : boards) {
    const bool is_found =
        std::ranges::any_of(found.spots, [&](const Spot& s) { return off(s, board) < 2.0; });
    EXPECT_TRUE(is_found) << board.transpose();
  }
}

TEST(SpotDetector, OfThePaperTakesNoWindowForABoard) {
  const auto pixels = picture(
      640, 480, [](int u, int v) { return u > 100 && u < 400 && v > 100 && v < 400 ? 255 : 10; });
  VisionConfig config;
  config.detector = SpotDetectorKind::kHough;
  SpotDetector detector{config};

  EXPECT_TRUE(detector.detect({pixels.data(), 640, 480, 640}).spots.empty());
}

/// OpenCV without memory.
struct NoMemory : cv::MatAllocator {
  [[noreturn]] static void refuse() { throw cv::Exception(cv::Error::StsNoMem, "none", "", "", 0); }
  cv::UMatData* allocate(int, const int*, int, void*, size_t*, cv::AccessFlag,
                         cv::UMatUsageFlags) const override {
    refuse();
  }
  bool allocate(cv::UMatData*, cv::AccessFlag, cv::UMatUsageFlags) const override { refuse(); }
  void deallocate(cv::UMatData*) const override {}
};

TEST(SpotDetector, OfThePaperSaysWhenOpenCvFails) {
  const auto pixels = picture(320, 240, [](int u, int v) { return u * v % 50; });
  VisionConfig config;
  config.detector = SpotDetectorKind::kHough;
  SpotDetector detector{config};
  NoMemory no_memory;
  cv::MatAllocator* const usual = cv::Mat::getDefaultAllocator();

  cv::Mat::setDefaultAllocator(&no_memory);
  const std::string failure(detector.detect({pixels.data(), 320, 240, 320}).failure);
  cv::Mat::setDefaultAllocator(usual);

  EXPECT_NE(failure.find("hough"), std::string::npos) << failure;
  EXPECT_TRUE(detector.detect({pixels.data(), 320, 240, 320}).failure.empty());
}

}  // namespace
}  // namespace crepes::spot_detector_test
