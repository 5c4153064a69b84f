// The scenes of vision_study.
#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "tests/study/vision_scene.hpp"

namespace crepes::study {
namespace {

/// Each of the four boards shows itself 20 times in 25 s, for 40 to 240 ms.
std::function<bool(std::size_t, double)> glimpses(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(0.0, 1.0);
  std::vector<std::vector<std::pair<double, double>>> seen(4);
  for (auto& times : seen)
    for (int i = 0; i < 20; ++i) {
      const double begin = 1.25 * i + any(random);
      times.emplace_back(begin, begin + 0.04 + 0.2 * any(random));
    }
  return [seen](std::size_t board, double t_s) {
    return std::none_of(seen[board].begin(), seen[board].end(),
                        [t_s](const auto& span) { return span.first <= t_s && t_s < span.second; });
  };
}

/// Four times a second and board, everything is hidden for `gap_s`.
std::function<bool(std::size_t, double)> gaps(double every_s, double gap_s) {
  return [=](std::size_t board, double t_s) {
    return t_s > 1.0 && std::fmod(t_s + 0.21 * static_cast<double>(board), every_s) < gap_s;
  };
}

bool propeller(std::size_t board, double t_s) {
  const double turns = 100.03 * t_s + 0.3 * static_cast<double>(board);
  return turns - std::floor(turns) < 0.25;
}

}  // namespace

std::vector<VisionScene> vision_scenes(std::uint64_t seed) {
  const LedBoard twelve{.leds = 12};
  const Eigen::Vector2d middle(640.0, 512.0);
  using Glare = PictureEffects::Glare;
  std::vector<VisionScene> scenes{
      {.name = "clean"},
      {.name = "twelve LEDs, 0.3 to 1 m", .board = twelve, .nearest_m = 0.3, .farthest_m = 1.0},
      {.name = "eight LEDs, 0.4 to 1.6 m",
       .board = {.leds = 8},
       .nearest_m = 0.4,
       .farthest_m = 1.6},
      {.name = "lens in the center, 1.5 m",
       .board = {.veil = 0.05},
       .nearest_m = 1.2,
       .farthest_m = 1.8},
      {.name = "defocus, 4 px",
       .effects = {.defocus_px = 4.0},
       .nearest_m = 2.0,
       .farthest_m = 8.0},
      {.name = "blur 3 ms, 600 deg/s",
       .effects = {.exposure_s = 0.003},
       .peak_rate_dps = 600.0,
       .turns_hz = 2.0},
      {.name = "blur 0.5 ms, 600 deg/s",
       .effects = {.exposure_s = 0.0005},
       .peak_rate_dps = 600.0,
       .turns_hz = 2.0},
      {.name = "faint, 18 to 27 m",
       .effects = {.light = 0.16},
       .nearest_m = 18.0,
       .farthest_m = 27.0},
      {.name = "fainter, 18 to 27 m",
       .effects = {.light = 0.12},
       .nearest_m = 18.0,
       .farthest_m = 27.0},
      {.name = "lit wall",
       .effects = {.light = 0.12, .background = 45.0},
       .nearest_m = 6.0,
       .farthest_m = 15.0},
      {.name = "window", .effects = {.glare = Glare{middle, {90.0, 130.0}, false}}},
      {.name = "sun of radius 80", .effects = {.glare = Glare{middle, {80.0, 80.0}, true}}},
      {.name = "16 % of frames lost", .lost_share = 0.16, .duration_s = 6.0},
      {.name = "gaps of 45 ms", .duration_s = 6.0, .is_hidden = gaps(0.6, 0.045)},
      {.name = "gaps of 80 ms", .duration_s = 6.0, .is_hidden = gaps(0.6, 0.080)},
      {.name = "gaps of 400 ms", .duration_s = 6.0, .is_hidden = gaps(1.2, 0.4)},
      {.name = "gaps of 490 ms", .duration_s = 6.0, .is_hidden = gaps(1.2, 0.49)},
      {.name = "crossing boards", .do_cross = true, .duration_s = 6.0},
      {.name = "propeller", .duration_s = 6.0, .is_hidden = propeller},
      {.name = "1500 hot pixels, row noise",
       .effects = {.row_noise = 2.0, .hot_pixels = 1500},
       .duration_s = 13.0,
       .score_from_s = 10.0},
      {.name = "rolling shutter, 150 deg/s",
       .effects = {.row_delay_s = 4.4e-6},
       .peak_rate_dps = 150.0},
      {.name = "foreign library", .is_foreign = true, .duration_s = 10.0},
      {.name = "glimpses",
       .duration_s = 25.0,
       .is_hidden = glimpses(static_cast<unsigned>(4 + seed))},
  };
  for (VisionScene& scene : scenes) scene.seed = seed;
  return scenes;
}

}  // namespace crepes::study
