#include "estimator/vision/spot_detector.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>
#include <numbers>
#include <random>

namespace crepes {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 480;

/// A picture in the making; LEDs are Gaussian and saturate.
struct Canvas {
  std::vector<double> light = std::vector<double>(kWidth * kHeight, 0.0);
  std::vector<std::uint8_t> pixels = std::vector<std::uint8_t>(kWidth * kHeight, 0);

  void led(double u, double v, double sigma_px, double level) {
    const int reach = static_cast<int>(std::ceil(4.0 * sigma_px));
    for (int y = static_cast<int>(v) - reach; y <= static_cast<int>(v) + reach; ++y)
      for (int x = static_cast<int>(u) - reach; x <= static_cast<int>(u) + reach; ++x)
        if (x >= 0 && y >= 0 && x < kWidth && y < kHeight)
          light[static_cast<std::size_t>(y * kWidth + x)] +=
              level *
              std::exp(-(std::pow(x - u, 2) + std::pow(y - v, 2)) / (2 * sigma_px * sigma_px));
  }
  /// The LEDs first..last-1 of a ring of six.
  void ring(double u, double v, double radius_px, double sigma_px, double level = 400.0,
            double turn = 0.3, int first = 0, int last = 6, double tilt = 1.0) {
    for (int k = first; k < last; ++k) {
      const double angle = turn + k * std::numbers::pi / 3.0;
      led(u + radius_px * std::cos(angle), v + tilt * radius_px * std::sin(angle), sigma_px, level);
    }
  }
  GrayImage image(double noise = 0.0, double background = 0.0, unsigned seed = 1) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(background, std::max(noise, 1e-9));
    for (std::size_t i = 0; i < light.size(); ++i)
      pixels[i] =
          static_cast<std::uint8_t>(std::clamp(std::lround(light[i] + normal(random)), 0L, 255L));
    return {pixels.data(), kWidth, kHeight, kWidth};
  }
};

double off(const Spot& spot, double u, double v) {
  return std::hypot(spot.u_px - u, spot.v_px - v);
}

TEST(SpotDetector, SeesARingAsOneSpotFromThirtyCentimetersToThirtyMeters) {
  EXPECT_TRUE(rc::check([] {
    const double radius = std::exp(*rc::gen::inRange(-20, 391) * 0.01);  // 0.8 to 49 px
    const double u = 300.0 + *rc::gen::inRange(0, 1000) * 1e-3;
    const double v = 240.0 + *rc::gen::inRange(0, 1000) * 1e-3;
    Canvas canvas;
    canvas.ring(u, v, radius, std::max(0.7, radius / 15.0), 300.0,
                *rc::gen::inRange(0, 100) * 0.01);
    SpotDetector detector{VisionConfig{}};

    const Detection found = detector.detect(canvas.image());

    RC_ASSERT(found.spots.size() == 1U);
    RC_ASSERT(off(found.spots[0], u, v) < 0.15);
    RC_ASSERT(found.exposure == Exposure::kGood);
  }));
}

TEST(SpotDetector, CentersARingOfWhichTwoLedsAreHidden) {
  Canvas canvas;
  canvas.ring(320.3, 200.7, 25.0, 1.5, 400.0, 0.3, 0, 4);
  SpotDetector detector{VisionConfig{}};

  const Detection found = detector.detect(canvas.image());

  ASSERT_EQ(found.spots.size(), 1U);
  EXPECT_LT(off(found.spots[0], 320.3, 200.7), 0.2);
}

TEST(SpotDetector, SeesATiltedRingAsOne) {
  Canvas canvas;
  canvas.ring(320.3, 200.7, 30.0, 1.5, 400.0, 0.3, 0, 6, 0.7);
  SpotDetector detector{VisionConfig{}};

  const Detection found = detector.detect(canvas.image());

  ASSERT_EQ(found.spots.size(), 1U);
  EXPECT_LT(off(found.spots[0], 320.3, 200.7), 0.1);
}

TEST(SpotDetector, KeepsTwoBoardsSideBySideApart) {
  for (const double radius : {1.5, 4.0, 20.0}) {
    Canvas canvas;
    canvas.ring(200.0, 200.0, radius, 0.8);
    canvas.ring(200.0 + 3.0 * radius + 8.0, 200.0, radius, 0.8);
    SpotDetector detector{VisionConfig{}};

    EXPECT_EQ(detector.detect(canvas.image()).spots.size(), 2U) << radius;
  }
}

TEST(SpotDetector, CentersASaturatedSpotWithoutBias) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> part(0.0, 1.0);
  SpotDetector detector{VisionConfig{}};
  double sum_u = 0.0;
  double sum_squares = 0.0;
  constexpr int kTrials = 300;
  for (int i = 0; i < kTrials; ++i) {
    const double u = 100.0 + part(random);
    const double v = 100.0 + part(random);
    Canvas canvas;
    canvas.led(u, v, 2.0, 3000.0);

    const Detection found = detector.detect(canvas.image(2.0, 8.0, static_cast<unsigned>(i)));

    ASSERT_EQ(found.spots.size(), 1U);
    sum_u += found.spots[0].u_px - u;
    sum_squares += std::pow(off(found.spots[0], u, v), 2) / 2.0;
  }
  EXPECT_LT(std::abs(sum_u / kTrials), 0.01);
  EXPECT_LT(std::sqrt(sum_squares / kTrials), 0.1);  // issue's bound to 10 m
}

TEST(SpotDetector, LeavesOutHotPixelsAndTheSun) {
  Canvas canvas;
  canvas.led(50.0, 60.0, 1.0, 300.0);
  canvas.light[100 * kWidth + 333] = 255.0;
  canvas.led(450.0, 270.0, 40.0, 1000.0);
  SpotDetector detector{VisionConfig{}};

  const Detection found = detector.detect(canvas.image());

  ASSERT_EQ(found.spots.size(), 1U);
  EXPECT_LT(off(found.spots[0], 50.0, 60.0), 0.1);
}

TEST(SpotDetector, TellsHowLongASpotIs) {
  Canvas canvas;
  for (int i = 0; i < 20; ++i) canvas.led(100.0 + i, 100.0 + i, 1.0, 300.0);
  canvas.led(300.0, 300.0, 3.0, 300.0);
  SpotDetector detector{VisionConfig{}};

  const Detection found = detector.detect(canvas.image());

  ASSERT_EQ(found.spots.size(), 2U);
  const Spot& streak = found.spots[0].u_px < 200.0 ? found.spots[0] : found.spots[1];
  const Spot& round = found.spots[0].u_px < 200.0 ? found.spots[1] : found.spots[0];
  EXPECT_GT(streak.elongation, 3.0);
  EXPECT_LT(round.elongation, 1.1);
}

TEST(SpotDetector, SaysWhenAllIsDarkOrFarTooBright) {
  SpotDetector detector{VisionConfig{}};
  Canvas dark;
  Canvas noisy;
  Canvas bright;
  for (std::size_t i = 0; i < bright.light.size(); ++i) bright.light[i] = i % 2 == 0 ? 255.0 : 0.0;

  EXPECT_EQ(detector.detect(dark.image()).exposure, Exposure::kDark);
  EXPECT_EQ(detector.detect(noisy.image(3.0, 40.0)).exposure, Exposure::kDark);
  const Detection found = detector.detect(bright.image());
  EXPECT_EQ(found.exposure, Exposure::kBright);
  EXPECT_TRUE(found.spots.empty());
}

TEST(SpotDetector, SurvivesEveryNoiseAndEverySize) {
  EXPECT_TRUE(rc::check([] {
    const int width = *rc::gen::inRange(1, 200);
    const int height = *rc::gen::inRange(1, 100);
    const int chance = *rc::gen::inRange(1, 40);
    std::mt19937 random(static_cast<unsigned>(*rc::gen::inRange(0, 1 << 30)));
    std::vector<std::uint8_t> pixels(static_cast<std::size_t>(width * height));
    for (auto& p : pixels) p = random() % 40U < unsigned(chance) / 4U ? random() % 256U : 0U;
    VisionConfig config;
    config.threshold = *rc::gen::inRange(0, 256);
    SpotDetector detector{config};

    const Detection found = detector.detect({pixels.data(), width, height, width});

    for (const Spot& spot : found.spots) {
      RC_ASSERT(spot.u_px > -0.5 * width && spot.u_px < 1.5 * width);
      RC_ASSERT(spot.v_px > -0.5 * height && spot.v_px < 1.5 * height);
      RC_ASSERT(spot.area_px2 >= config.min_area_px2);
      RC_ASSERT(std::isfinite(spot.elongation));
    }
  }));
}

TEST(SpotDetector, OfThePaperFindsTheSameBoard) {
  Canvas canvas;
  canvas.ring(320.0, 200.0, 5.0, 1.2);
  VisionConfig config;
  config.detector = SpotDetectorKind::kHough;
  SpotDetector detector{config};

  const Detection found = detector.detect(canvas.image());

  ASSERT_EQ(found.spots.size(), 1U);
  EXPECT_LT(off(found.spots[0], 320.0, 200.0), 2.5);  // its circles have whole-pixel centers
}

}  // namespace
}  // namespace crepes
