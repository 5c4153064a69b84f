// What the spot detector takes from the heap.
#include <gtest/gtest.h>

#include "estimator/vision/spot_detector.hpp"
#include "tests/allocation/allocation_counter.hpp"
#include "tests/support/ring_scene.hpp"

namespace crepes::spot_detector_allocation_test {
namespace {

using test::allocated_bytes;
using test::allocations;

using Pixels = std::vector<std::uint8_t>;

/// Boards far and near, lamps, a sun and hot pixels, different in every picture.
Pixels varied_picture(unsigned seed) {
  const CameraModel camera = test::small_fisheye();
  std::mt19937 random(seed);
  test::RingScene scene(camera, {.exposure = 0.5 + random() % 8U}, seed);
  for (unsigned i = 0; i <= seed % 4U; ++i)
    scene.add_ring(
        test::random_board(random, 0.5 + 0.25 * (random() % 40U), 0.1 * (random() % 8U)));
  for (unsigned i = random() % 60U; i > 0; --i)
    scene.add_point({1.0 * (random() % 320U), 1.0 * (random() % 256U)}, 10.0 * (random() % 90U));
  for (unsigned i = random() % 60U; i > 0; --i)
    scene.set_pixel(int(random() % 320U), int(random() % 256U), 200.0);
  if (seed % 5U == 0)
    scene.add_disc({40.0 * (random() % 8U), 128.0}, 20.0 * (random() % 8U), 500.0);
  const GrayImage image = scene.read();
  return {image.pixels, image.pixels + image.stride * image.height};
}

std::vector<Pixels> varied_pictures(unsigned first, unsigned count) {
  std::vector<Pixels> pictures;
  for (unsigned i = first; i < first + count; ++i) pictures.push_back(varied_picture(i));
  return pictures;
}

std::size_t show(SpotDetector& detector, const Pixels& pixels, int width = 320, int height = 256) {
  return detector.detect({pixels.data(), width, height, width}).spots.size();
}

TEST(SpotDetectorAllocation, IsCountedHere) {
  const std::size_t before = allocations();
  const auto one = std::make_unique<int>(1);

  EXPECT_GT(allocations(), before);
}

TEST(SpotDetectorAllocation, EndsAfterTheFirstPictures) {
  const std::vector<Pixels> first = varied_pictures(0, 30);
  const std::vector<Pixels> then = varied_pictures(100, 60);
  SpotDetector detector{VisionConfig{}};
  for (const Pixels& pixels : first) show(detector, pixels);

  const std::size_t before = allocations();
  std::size_t spots = 0;
  for (const Pixels& pixels : then) spots += show(detector, pixels);

  EXPECT_EQ(allocations() - before, 0U);
  EXPECT_GT(spots, 300U);
}

TEST(SpotDetectorAllocation, IsBoundedWhateverThePictureShows) {
  constexpr int kSide = 2048;
  std::vector<Pixels> pictures;
  for (const unsigned chance : {2U, 5U, 20U, 60U, 200U, 1000U, 10000U}) {
    std::mt19937 random(chance);
    Pixels pixels(kSide * kSide);
    for (auto& p : pixels) p = random() % chance == 0 ? 255 : 4;
    pictures.push_back(std::move(pixels));
  }
  SpotDetector detector{VisionConfig{}};

  const std::size_t before = allocated_bytes();
  for (const Pixels& pixels : pictures) show(detector, pixels, kSide, kSide);
  const std::size_t first_time = allocated_bytes() - before;
  for (const Pixels& pixels : pictures) show(detector, pixels, kSide, kSide);

  EXPECT_LT(first_time, 32U << 20U);  // all that was ever asked for, growing in steps
  EXPECT_EQ(allocated_bytes() - before, first_time);
}

}  // namespace
}  // namespace crepes::spot_detector_allocation_test
