#include <gtest/gtest.h>

#include <algorithm>
#include <ostream>

#include "tests/study/vision_scene.hpp"

namespace crepes::study::difficult_pictures_test {
namespace {

/// A scene of vision_study, as short as it can be.
struct Row {
  const char* scene;
  double least_percent;  ///< of the lit frames have a right bearing
  double duration_s = 1.6;
};
void PrintTo(const Row& row, std::ostream* out) { *out << row.scene; }

VisionScene scene_of(const Row& row) {
  const auto scenes = vision_scenes(1);
  const auto found = std::ranges::find(scenes, row.scene, &VisionScene::name);
  VisionScene scene = *found;
  scene.duration_s = row.duration_s;
  scene.score_from_s = std::min(0.8, 0.5 * row.duration_s);
  return scene;
}

class DifficultPictures : public testing::TestWithParam<Row> {};

TEST_P(DifficultPictures, ShowEachBoardUnderItsOwnId) {
  const VisionScore score = score_vision(scene_of(GetParam()));

  EXPECT_GT(score.lit, 150U);
  EXPECT_GE(score.right_percent(), GetParam().least_percent);
  EXPECT_EQ(score.wrong, 0U);
}

INSTANTIATE_TEST_SUITE_P(
    Scene, DifficultPictures,
    testing::Values(Row{"clean", 100.0}, Row{"twelve LEDs, 0.3 to 1 m", 98.0},
                    Row{"eight LEDs, 0.4 to 1.6 m", 99.0}, Row{"lens in the center, 1.5 m", 99.0},
                    Row{"defocus, 4 px", 99.0}, Row{"blur 3 ms, 600 deg/s", 60.0},
                    Row{"blur 0.5 ms, 600 deg/s", 97.0}, Row{"faint, 18 to 27 m", 90.0},
                    Row{"lit wall", 95.0}, Row{"window", 95.0}, Row{"sun of radius 80", 95.0},
                    Row{"16 % of frames lost", 97.0}, Row{"gaps of 45 ms", 97.0, 2.4},
                    Row{"gaps of 400 ms", 97.0, 3.2}, Row{"gaps of 490 ms", 97.0, 3.2},
                    Row{"crossing boards", 80.0, 2.4}, Row{"propeller", 90.0, 2.0},
                    Row{"rolling shutter, 150 deg/s", 94.0}));

// Aslant, the LEDs along two edges touch, and those along the others do not.
TEST(Rings, OfSquareBoardsAreOneSpot) {
  RingScore sum;
  for (const int leds : {12, 16}) {
    const RingScore score = score_rings({.leds = {leds},
                                         .radii_m = {0.01, 0.02, 0.03, 0.045, 0.06},
                                         .is_square = true,
                                         .pictures = 150,
                                         .seed = 42});
    sum.pictures += score.pictures;
    sum.one_spot += score.one_spot;
    sum.centered += score.centered;
  }

  EXPECT_GE(sum.one_spot, 0.98 * sum.pictures);
  EXPECT_GE(sum.centered, 0.97 * sum.pictures);
}

// At this distance twelve LEDs touch, and brighter and darker ones leave two halves.
TEST(Rings, ThatFallIntoArcsAreOneSpot) {
  const RingScore score = score_rings({.leds = {12},
                                       .radii_m = {0.03},
                                       .nearest_m = 0.85,
                                       .farthest_m = 1.1,
                                       .tilt_rad = 0.785,
                                       .pictures = 250});

  EXPECT_EQ(score.one_spot, score.pictures);
  EXPECT_GE(score.centered, score.pictures - 2);
}

TEST(ForeignBoards, AreNotNamed) {
  const VisionScore score = score_vision(scene_of({"foreign library", 0.0, 3.0}));

  EXPECT_EQ(score.wrong, 0U);
  EXPECT_EQ(score.never, 4U);
}

}  // namespace
}  // namespace crepes::study::difficult_pictures_test
