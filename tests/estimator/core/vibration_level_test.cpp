#include "estimator/core/vibration_level.hpp"

#include <gtest/gtest.h>

#include "tests/support/random_geometry.hpp"

namespace crepes::vibration_level_test {
namespace {

using test::RandomGeometry;

/// What three successive samples of white noise say of its density squared; five of six in common
/// with the ones before do not matter here.
double noise2_of(RandomGeometry& random, double density2) {
  return density2 * random.normal_vector<3>(1.0).squaredNorm() / 3.0;
}

TEST(VibrationLevel, SteadyNoiseIsNoChange) {
  double change2 = 0.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    RandomGeometry random(seed);
    VibrationLevel level;
    for (int i = 0; i < 12'000; ++i) change2 += level.observe(noise2_of(random, 0.02));
  }
  EXPECT_LT(change2, 20 * 0.02) << "less than one change in two minutes";
}

TEST(VibrationLevel, ThePartsOfAStartAndOfAnEndAddUp) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    RandomGeometry random(seed);
    VibrationLevel level;
    for (int i = 0; i < 200; ++i) EXPECT_EQ(level.observe(noise2_of(random, 3e-6)), 0.0) << seed;
    double start2 = 0.0;
    for (int i = 0; i < 150; ++i) start2 += level.observe(noise2_of(random, 0.02));
    EXPECT_GT(start2, 0.006) << seed << ": within 1.5 s";
    EXPECT_LT(start2, 0.04) << seed;
    double end2 = 0.0;
    for (int i = 0; i < 150; ++i) end2 += level.observe(noise2_of(random, 3e-6));
    EXPECT_GT(end2, 0.006) << seed;
    EXPECT_LT(end2, 0.04) << seed;
  }
}

// Its values repeat while it is at rest, perhaps for minutes.
TEST(VibrationLevel, ACoarseSensorThatShowedNoNoiseStartsToVibrate) {
  RandomGeometry random(1);
  VibrationLevel level;
  for (int i = 0; i < 100'000; ++i) EXPECT_EQ(level.observe(0.0), 0.0);
  double start2 = 0.0;
  for (int i = 0; i < 150; ++i) start2 += level.observe(noise2_of(random, 0.02));
  EXPECT_GT(start2, 0.006);
}

// Each sample is in three differences.
TEST(VibrationLevel, ABlowIsNoVibration) {
  RandomGeometry random(1);
  VibrationLevel level;
  double change2 = 0.0;
  for (int i = 0; i < 1000; ++i)
    change2 += level.observe(i % 300 < 3 && i > 100 ? 1.0 : noise2_of(random, 3e-6));
  EXPECT_LT(change2, 1e-5);
}

}  // namespace
}  // namespace crepes::vibration_level_test
