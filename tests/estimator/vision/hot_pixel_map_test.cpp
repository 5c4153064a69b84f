#include "estimator/vision/hot_pixel_map.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "estimator/vision/spot_detector.hpp"

namespace crepes::hot_pixel_map_test {
namespace {

constexpr int kWidth = 160;
constexpr int kHeight = 120;

/// A camera with noise whose pixels can be set.
class Camera {
 public:
  GrayImage read() {
    for (std::size_t i = 0; i < pixels_.size(); ++i)
      pixels_[i] = static_cast<std::uint8_t>(
          std::clamp(std::lround(levels_[i] + noise_(random_)), 0L, 255L));
    return {pixels_.data(), kWidth, kHeight, kWidth};
  }
  double& at(int u, int v) { return levels_[static_cast<std::size_t>(v * kWidth + u)]; }
  void add_point(double u, double v, double peak) {
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        at(x, y) += peak * std::exp(-0.5 * (std::pow(x - u, 2) + std::pow(y - v, 2)) / 0.8);
  }

 private:
  std::vector<double> levels_ = std::vector<double>(std::size_t{kWidth} * kHeight, 15.0);
  std::vector<std::uint8_t> pixels_ = std::vector<std::uint8_t>(std::size_t{kWidth} * kHeight);
  std::mt19937 random_{1};
  std::normal_distribution<double> noise_{0.0, 1.5};
};

std::size_t look(SpotDetector& detector, Camera& camera, int pictures) {
  std::size_t known = 0;
  for (int i = 0; i < pictures; ++i) known = detector.detect(camera.read()).hot_pixels.size();
  return known;
}

TEST(HotPixelMap, LearnsPixelsThatShineInEveryPicture) {
  SpotDetector detector{VisionConfig{}};
  Camera camera;
  camera.at(50, 40) = 120.0;
  camera.at(51, 40) = 90.0;  // two side by side look like a light
  camera.at(90, 70) = 200.0;

  EXPECT_EQ(detector.detect(camera.read()).spots.size(), 1U);
  EXPECT_EQ(look(detector, camera, HotPixelMap::kKnown + 10), 3U);
  const Detection found = detector.detect(camera.read());
  EXPECT_TRUE(found.spots.empty());
  EXPECT_EQ(found.rejected.hot, 0U);
}

TEST(HotPixelMap, DoesNotLearnABoardThatIsDarkInOneFrameOfFifty) {
  SpotDetector detector{VisionConfig{}};
  Camera dark;
  Camera lit;
  lit.add_point(50.2, 40.4, 60.0);
  std::size_t known = 0;
  for (int i = 0; i < 4 * HotPixelMap::kKnown; ++i)
    known = std::max(known, detector.detect((i % 50 == 0 ? dark : lit).read()).hot_pixels.size());

  EXPECT_EQ(known, 0U);
  EXPECT_EQ(detector.detect(lit.read()).spots.size(), 1U);
}

TEST(HotPixelMap, ForgetsWhatIsDarkAgain) {
  SpotDetector detector{VisionConfig{}};
  Camera camera;
  camera.at(50, 40) = 120.0;
  ASSERT_EQ(look(detector, camera, 2 * HotPixelMap::kKnown), 1U);

  camera.at(50, 40) = 15.0;

  EXPECT_EQ(look(detector, camera, 3), 0U);
}

TEST(HotPixelMap, LetsABoardPassOverAHotPixel) {
  SpotDetector detector{VisionConfig{}};
  Camera camera;
  camera.at(50, 40) = 120.0;
  ASSERT_EQ(look(detector, camera, HotPixelMap::kKnown + 10), 1U);
  for (double u = 47.0; u <= 53.0; u += 0.5) {
    Camera scene;
    scene.add_point(u, 40.3, 80.0);
    scene.at(50, 40) = std::max(scene.at(50, 40), 120.0);

    const Detection found = detector.detect(scene.read());

    ASSERT_EQ(found.spots.size(), 1U) << u;
    EXPECT_NEAR(found.spots[0].u_px, u, 0.3) << u;
    EXPECT_NEAR(found.spots[0].v_px, 40.3, 0.3) << u;
  }
}

TEST(HotPixelMap, BeginsAnewWithPicturesOfAnotherSize) {
  HotPixelMap map;
  const std::vector<std::uint8_t> white(100 * 100, 255);
  map.add_frame({white.data(), 100, 100, 100}, 200);
  map.suspect(90, 90);
  for (int i = 0; i <= HotPixelMap::kKnown; ++i) map.add_frame({white.data(), 100, 100, 100}, 200);
  ASSERT_EQ(map.known().size(), 1U);

  map.add_frame({white.data(), 50, 50, 50}, 200);

  EXPECT_TRUE(map.known().empty());
}

}  // namespace
}  // namespace crepes::hot_pixel_map_test
