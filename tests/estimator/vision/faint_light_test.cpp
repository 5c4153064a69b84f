#include "estimator/vision/faint_light.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "estimator/vision/spot_detector.hpp"

namespace crepes::faint_light_test {
namespace {

/// Gray noise, and the images of points on it.
class NoisyPicture {
 public:
  NoisyPicture(int width, int height, double level, double sigma, unsigned seed)
      : width_(width), height_(height), random_(seed), noise_(level, sigma) {
    for (int i = 0; i < width * height; ++i) levels_.push_back(noise_(random_));
  }

  void add_point(double u, double v, double peak, double blur = 0.87) {
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x)
        at(x, y) += peak * std::exp(-0.5 * (std::pow(x - u, 2) + std::pow(y - v, 2)) / blur / blur);
  }
  double& at(int u, int v) { return levels_[static_cast<std::size_t>(v * width_ + u)]; }

  /// Valid until the next call.
  GrayImage read() {
    pixels_.clear();
    for (const double level : levels_)
      pixels_.push_back(static_cast<std::uint8_t>(std::clamp(std::lround(level), 0L, 255L)));
    return {pixels_.data(), width_, height_, width_};
  }

 private:
  int width_;
  int height_;
  std::mt19937 random_;
  std::normal_distribution<double> noise_;
  std::vector<double> levels_;
  std::vector<std::uint8_t> pixels_;
};

TEST(FaintLight, IsFoundAndCenteredAtSevenSigmas) {
  int found = 0;
  double squares = 0.0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    NoisyPicture picture(40, 40, 20.0, 2.0, seed);
    const double u = 19.5 + 0.01 * seed;
    picture.add_point(u, 20.2, 14.0);

    const auto light = find_faint_light(picture.read(), static_cast<int>(std::lround(u)), 20);

    if (!light || light->is_hot) continue;
    ++found;
    squares += std::pow(light->spot.u_px - u, 2) + std::pow(light->spot.v_px - 20.2, 2);
  }

  EXPECT_GE(found, 97);
  // The least possible is sigma / peak * sqrt(2 / pi) = 0.11 px an axis, 0.16 px in both.
  EXPECT_LT(std::sqrt(squares / found), 0.22);
}

TEST(FaintLight, IsMeasuredAgainstTheNoiseAroundIt) {
  NoisyPicture calm(40, 40, 20.0, 1.0, 1);
  NoisyPicture rough(40, 40, 20.0, 5.0, 1);
  calm.add_point(20.0, 20.0, 12.0);
  rough.add_point(20.0, 20.0, 12.0);

  EXPECT_TRUE(find_faint_light(calm.read(), 20, 20));
  EXPECT_FALSE(find_faint_light(rough.read(), 20, 20));
}

TEST(FaintLight, OfASinglePixelIsHot) {
  NoisyPicture picture(40, 40, 20.0, 1.5, 1);
  picture.at(20, 20) = 40.0;

  const auto light = find_faint_light(picture.read(), 20, 20);

  ASSERT_TRUE(light);
  EXPECT_TRUE(light->is_hot);
}

TEST(FaintLight, AtTheEdgeOfThePictureIsNone) {
  NoisyPicture picture(40, 40, 20.0, 1.0, 1);
  picture.add_point(1.0, 20.0, 30.0);

  EXPECT_FALSE(find_faint_light(picture.read(), 1, 20));
}

TEST(FaintLight, DoesNotAppearInPicturesOfNoise) {
  // 24 pictures of 640x512 are six of 1280x1024.
  for (const double sigma : {0.6, 1.5, 4.0}) {
    SpotDetector detector{VisionConfig{}};
    std::size_t spots = 0;
    for (unsigned seed = 0; seed < 24; ++seed)
      spots += detector.detect(NoisyPicture(640, 512, 30.0, sigma, seed).read()).spots.size();

    EXPECT_EQ(spots, 0U) << sigma;
  }
}

TEST(FaintLight, IsASpotFromItsSecondPictureOn) {
  SpotDetector detector{VisionConfig{}};
  int right = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    NoisyPicture picture(320, 256, 30.0, 1.5, seed);
    picture.add_point(100.3 + 0.5 * seed, 90.6, 9.0);

    const Detection found = detector.detect(picture.read());

    right += found.spots.size() == 1 && std::abs(found.spots[0].u_px - 100.3 - 0.5 * seed) < 1.0;
  }

  EXPECT_GE(right, 37);
}

TEST(FaintLight, IsASpotAtOnceWhereItIsClear) {
  NoisyPicture picture(320, 256, 30.0, 1.5, 1);
  picture.add_point(100.3, 90.6, 15.0);
  SpotDetector detector{VisionConfig{}};

  EXPECT_EQ(detector.detect(picture.read()).spots.size(), 1U);
}

TEST(FaintLight, BesideABrightOneBelongsToIt) {
  SpotDetector detector{VisionConfig{}};
  NoisyPicture picture(320, 256, 30.0, 1.5, 1);
  picture.add_point(100.0, 90.0, 180.0, 2.0);
  picture.add_point(109.0, 90.0, 15.0);

  EXPECT_EQ(detector.detect(picture.read()).spots.size(), 1U);
}

TEST(FaintLight, IsLeftToAThresholdThatIsConfigured) {
  VisionConfig config;
  config.threshold = 60;
  SpotDetector detector{config};
  NoisyPicture picture(320, 256, 30.0, 1.5, 1);
  picture.add_point(100.0, 90.0, 15.0);

  EXPECT_TRUE(detector.detect(picture.read()).spots.empty());
}

}  // namespace
}  // namespace crepes::faint_light_test
