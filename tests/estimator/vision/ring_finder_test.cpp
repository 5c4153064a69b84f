// Rings of every make in pictures: RingFinder, ArcJoiner and what SpotDetector makes of them.
#include "estimator/vision/ring_finder.hpp"

#include <gtest/gtest.h>

#include <random>

#include "estimator/vision/spot_detector.hpp"
#include "tests/support/ring_scene.hpp"

namespace crepes::ring_finder_test {
namespace {

using test::random_board;
using test::RingBoard;
using test::RingScene;
using test::small_fisheye;

constexpr double kSeventyDegrees = 1.22;

double between(std::mt19937& random, double least, double most) {
  return std::uniform_real_distribution<double>(least, most)(random);
}

/// A board at up to `farthest_m`, up to `most_aslant` [rad].
Pose board_within(std::mt19937& random, double farthest_m, double most_aslant) {
  const double aslant = between(random, 0.0, most_aslant);
  const double range_m = between(random, 0.4, farthest_m);
  return random_board(random, range_m, aslant);
}

/// Pictures of one board each, and those with exactly one spot, within a pixel of its center.
struct Tally {
  int pictures = 0;
  int right = 0;

  [[nodiscard]] double share() const { return static_cast<double>(right) / pictures; }
};

void look(SpotDetector& detector, const RingBoard& board, const Pose& T_C_M, unsigned seed,
          Tally& tally) {
  RingScene scene(small_fisheye(), {}, seed);
  const Eigen::Vector2d center = scene.add_ring(T_C_M, board);
  const Detection found = detector.detect(scene.read());
  ++tally.pictures;
  if (found.spots.size() != 1) return;
  const Eigen::Vector2d spot(found.spots[0].u_px, found.spots[0].v_px);
  tally.right += (spot - center).norm() <= 1.0 ? 1 : 0;
}

TEST(RingFinder, SeesOneSpotInTheCenterOfEveryRoundRing) {
  std::mt19937 random(1);
  SpotDetector detector{VisionConfig{}};
  Tally all;
  for (int leds = kMinRingLeds; leds <= kMaxRingLeds; ++leds) {
    Tally of_number;
    for (unsigned i = 0; i < 60; ++i) {
      const RingBoard board{.leds = leds, .radius_m = between(random, 0.01, 0.06)};
      const Pose T_C_M = board_within(random, 1.6, kSeventyDegrees);
      look(detector, board, T_C_M, i, of_number);
    }
    EXPECT_GE(of_number.share(), 0.93) << leds << " LEDs";
    all.pictures += of_number.pictures;
    all.right += of_number.right;
  }
  RecordProperty("percent", std::to_string(100.0 * all.share()));
  EXPECT_GE(all.share(), 0.97);
}

TEST(RingFinder, SeesOneSpotInTheCenterOfSquares) {
  std::mt19937 random(2);
  SpotDetector detector{VisionConfig{}};
  for (const int leds : {4, 8, 12}) {
    Tally tally;
    for (unsigned i = 0; i < 60; ++i) {
      const RingBoard board{
          .leds = leds, .is_square = true, .radius_m = between(random, 0.01, 0.06)};
      look(detector, board, board_within(random, 1.6, kSeventyDegrees), i, tally);
    }
    EXPECT_GE(tally.share(), 0.95) << leds << " LEDs";
  }
}

TEST(RingFinder, IsNotMisledByALensInTheMiddle) {
  std::mt19937 random(3);
  SpotDetector detector{VisionConfig{}};
  for (const int leds : {5, 6, 8, 12}) {
    Tally tally;
    for (unsigned i = 0; i < 60; ++i) {
      const RingBoard board{.leds = leds, .lens = between(random, 0.01, 0.3)};
      look(detector, board, board_within(random, 2.0, 0.785), i, tally);
    }
    EXPECT_GE(tally.share(), 0.98) << leds << " LEDs";
  }
}

TEST(RingFinder, CentersRingsOfWhichAThirdIsHidden) {
  std::mt19937 random(4);
  SpotDetector detector{VisionConfig{}};
  for (const int leds : {6, 8, 9, 10, 12}) {
    Tally tally;
    for (unsigned i = 0; i < 60; ++i) {
      const int hidden = 1 + static_cast<int>(random() % static_cast<unsigned>(leds / 3));
      const RingBoard board{.leds = leds, .radius_m = 0.05, .hidden = (1U << hidden) - 1U};
      look(detector, board, board_within(random, 0.8, 0.6), i, tally);
    }
    EXPECT_GE(tally.share(), 0.95) << leds << " LEDs";
  }
}

TEST(RingFinder, KeepsRingsBesideEachOtherApart) {
  std::mt19937 random(5);
  SpotDetector detector{VisionConfig{}};
  int right = 0;
  constexpr int kPictures = 150;
  for (unsigned i = 0; i < kPictures; ++i) {
    const double range = between(random, 0.4, 3.0);
    const double radius_px = 0.03 / range * 317.0;
    const double apart = 2.0 * radius_px + between(random, 12.0, 30.0);
    RingScene scene(small_fisheye(), {}, i);
    std::array<Eigen::Vector2d, 2> centers;
    for (std::size_t k = 0; k < 2; ++k) {
      Pose T_C_M = random_board(random, range, 0.6);
      const Eigen::Vector2d uv(160.0 + (k == 0 ? -0.5 : 0.5) * apart, 128.0);
      T_C_M.p = range * small_fisheye().unproject(uv).value();
      const RingBoard board{.leds = 5 + static_cast<int>(random() % 8U)};
      centers[k] = scene.add_ring(T_C_M, board);
    }
    const Detection found = detector.detect(scene.read());
    if (found.spots.size() != 2) continue;
    const bool is_swapped = found.spots[0].u_px > found.spots[1].u_px;
    bool is_right = true;
    for (std::size_t k = 0; k < 2; ++k) {
      const Spot& spot = found.spots[is_swapped ? 1 - k : k];
      is_right &= (Eigen::Vector2d(spot.u_px, spot.v_px) - centers[k]).norm() < 1.0;
    }
    right += is_right ? 1 : 0;
  }
  EXPECT_GE(right, 0.95 * kPictures);
}

TEST(RingFinder, TakesRobotsFarAwayForNoRing) {
  std::mt19937 random(6);
  SpotDetector detector{VisionConfig{}};
  int pictures = 0;
  int joined = 0;
  for (unsigned i = 0; i < 200; ++i) {
    RingScene scene(small_fisheye(), {}, i);
    std::vector<Eigen::Vector2d> centers;
    while (centers.size() < 3 + i % 5) {
      const double v = between(random, 90.0, 170.0);
      const double u = between(random, 120.0, 200.0);
      const Eigen::Vector2d uv(u, v);
      const bool is_apart = std::all_of(centers.begin(), centers.end(),
                                        [&](const auto& c) { return (c - uv).norm() > 12.0; });
      if (!is_apart) continue;
      Pose T_C_M = random_board(random, 12.0, 0.6);
      T_C_M.p = 12.0 * small_fisheye().unproject(uv).value();
      centers.push_back(scene.add_ring(T_C_M));
    }
    ++pictures;
    joined += detector.detect(scene.read()).spots.size() == centers.size() ? 0 : 1;
  }
  EXPECT_LE(joined, pictures / 100);
}

}  // namespace
}  // namespace crepes::ring_finder_test
