#include "estimator/vision/separate_lights.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace crepes::separate_lights_test {
namespace {

/// Gaussian lights on black.
class Scene {
 public:
  static constexpr int kWidth = 120;
  static constexpr int kHeight = 90;

  void add(double u, double v, double peak, double sigma_px) {
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        light_[static_cast<std::size_t>(y * kWidth + x)] +=
            peak *
            std::exp(-0.5 * (std::pow(x - u, 2) + std::pow(y - v, 2)) / (sigma_px * sigma_px));
  }
  [[nodiscard]] std::vector<Spot> lights() const {
    std::vector<std::uint8_t> pixels;
    for (const double light : light_)
      pixels.push_back(static_cast<std::uint8_t>(std::min(255.0, light)));
    return separate_lights(
        {.pixels = pixels.data(), .width = kWidth, .height = kHeight, .stride = kWidth});
  }

 private:
  std::vector<double> light_ = std::vector<double>(static_cast<std::size_t>(kWidth) * kHeight, 4.0);
};

double nearest(const std::vector<Spot>& lights, double u, double v) {
  double least = 1e9;
  for (const Spot& spot : lights) least = std::min(least, std::hypot(spot.u_px - u, spot.v_px - v));
  return least;
}

TEST(SeparateLights, CentersAFaintAndASaturatedLight) {
  Scene scene;
  scene.add(30.3, 40.7, 60.0, 1.5);
  scene.add(80.6, 50.2, 2000.0, 2.0);

  const auto lights = scene.lights();

  ASSERT_EQ(lights.size(), 2U);
  EXPECT_LT(nearest(lights, 30.3, 40.7), 0.08);
  EXPECT_LT(nearest(lights, 80.6, 50.2), 0.08);
}

TEST(SeparateLights, PartsLightsThatBloomIntoEachOther) {
  Scene scene;
  scene.add(40.0, 40.0, 200.0, 2.5);
  scene.add(47.0, 40.0, 120.0, 2.0);

  const auto lights = scene.lights();

  ASSERT_EQ(lights.size(), 2U);
  EXPECT_LT(nearest(lights, 40.0, 40.0), 0.5);
  EXPECT_LT(nearest(lights, 47.0, 40.0), 0.6);
}

TEST(SeparateLights, LeavesOutALightThatTheBorderCuts) {
  Scene scene;
  scene.add(0.5, 40.0, 200.0, 2.0);
  scene.add(60.0, 40.0, 200.0, 2.0);

  EXPECT_EQ(scene.lights().size(), 1U);
}

TEST(SeparateLights, FindsNothingInTheDark) { EXPECT_TRUE(Scene().lights().empty()); }

}  // namespace
}  // namespace crepes::separate_lights_test
