// What detector and tracker make of difficult pictures: vision_study [seed=N] [NAME_PART...]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string_view>

#include "estimator/core/quantile.hpp"
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

std::vector<VisionScene> scenes(std::uint64_t seed) {
  const LedBoard twelve{.leds = 12};
  const Eigen::Vector2d middle(640.0, 512.0);
  const PictureEffects faint{.light = 0.12};
  using Glare = PictureEffects::Glare;
  return {
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
      {.name = "faint, 18 to 27 m", .effects = faint, .nearest_m = 18.0, .farthest_m = 27.0},
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
      {.name = "crossing boards", .do_cross = true, .duration_s = 6.0},
      {.name = "propeller", .duration_s = 6.0, .is_hidden = propeller},
      {.name = "1500 hot pixels, row noise", .effects = {.row_noise = 2.0, .hot_pixels = 1500}},
      {.name = "rolling shutter, 150 deg/s",
       .effects = {.row_delay_s = 4.4e-6},
       .peak_rate_dps = 150.0},
      {.name = "foreign library", .is_foreign = true, .duration_s = 5.0},
      {.name = "glimpses",
       .duration_s = 25.0,
       .is_hidden = glimpses(static_cast<unsigned>(4 + seed))},
  };
}

void print(const VisionScene& scene, const VisionScore& score) {
  std::vector<double> errors_px = score.errors_px;
  if (errors_px.empty()) errors_px.push_back(0.0);
  std::printf("%-28s %6zu  %6.2f  %5zu  %6zu  %8.2f  %6.2f  %6.2f  %5zu  %5.2f\n",
              scene.name.c_str(), score.lit,
              100.0 * static_cast<double>(score.identified) /
                  static_cast<double>(std::max<std::size_t>(1, score.lit)),
              score.wrong, score.astray,
              static_cast<double>(score.false_spots) /
                  static_cast<double>(std::max<std::size_t>(1, score.pictures)),
              quantile(errors_px, 0.5), quantile(errors_px, 0.99), score.never, score.slowest_s);
  std::fflush(stdout);
}

void print_rings(const char* name, const RingPictures& rings) {
  const RingScore score = score_rings(rings);
  std::printf("%-40s %5d  %6.2f  %6.2f\n", name, score.pictures,
              100.0 * score.one_spot / score.pictures, 100.0 * score.centered / score.pictures);
  std::fflush(stdout);
}

/// The argument seed=N, 1 without it.
std::uint64_t seed_of(int argc, char** argv) {
  constexpr std::string_view kKey = "seed=";
  for (int i = 1; i < argc; ++i)
    if (std::string_view(argv[i]).substr(0, kKey.size()) == kKey)
      return std::strtoull(argv[i] + kKey.size(), nullptr, 10);
  return 1;
}

bool is_wanted(std::string_view name, int argc, char** argv) {
  return argc < 2 || std::any_of(argv + 1, argv + argc, [&](const char* part) {
           return name.find(part) != std::string_view::npos;
         });
}

}  // namespace
}  // namespace crepes::study

int main(int argc, char** argv) {
  using namespace crepes::study;
  if (is_wanted("rings", argc, argv)) {
    std::printf("%-40s %5s  %6s  %6s\n", "single pictures", "n", "one %", "centered %");
    const std::vector<double> radii{0.01, 0.02, 0.03, 0.045, 0.06};
    print_rings("six, 3 cm, to 45 deg", {.leds = {6}, .radii_m = {0.03}, .tilt_rad = 0.785});
    print_rings("eight, 3 cm, to 45 deg", {.leds = {8}, .radii_m = {0.03}, .tilt_rad = 0.785});
    print_rings("eight, 3 cm, to 70 deg", {.leds = {8}, .radii_m = {0.03}});
    for (const int leds : {4, 5, 6, 7, 8, 9, 10, 12, 14, 16})
      print_rings(("round, " + std::to_string(leds) + " LEDs, 2 to 12 cm, to 70 deg").c_str(),
                  {.leds = {leds}, .radii_m = radii, .pictures = 150});
    for (const int leds : {4, 8, 12, 16})
      print_rings(("square, " + std::to_string(leds) + " LEDs, 2 to 12 cm, to 70 deg").c_str(),
                  {.leds = {leds}, .radii_m = radii, .is_square = true, .pictures = 150});
    print_rings("six, lens in the center, 1 to 2 m", {.leds = {6},
                                                      .radii_m = {0.03},
                                                      .nearest_m = 1.0,
                                                      .farthest_m = 2.0,
                                                      .tilt_rad = 0.785,
                                                      .veil = 0.05});
  }
  std::printf("%-28s %6s  %6s  %5s  %6s  %8s  %6s  %6s  %5s  %5s\n", "scene", "lit", "right%",
              "wrong", "astray", "false/pic", "med px", "p99 px", "never", "ID s");
  const std::uint64_t seed = seed_of(argc, argv);
  for (VisionScene& scene : scenes(seed)) {
    scene.seed = seed;
    if (is_wanted(scene.name, argc, argv)) print(scene, score_vision(scene));
  }
  return 0;
}
