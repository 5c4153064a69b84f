// What detector and tracker make of difficult pictures:
// vision_study [seeds=FIRST-LAST] [detector=hough] [NAME_PART...]
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "estimator/core/quantile.hpp"
#include "tests/study/vision_scene.hpp"

namespace crepes::study {
namespace {

struct Seeds {
  unsigned first = 1;
  unsigned last = 6;
};

/// 0 where nothing was measured.
double share_of(std::vector<double> values, double share) {
  return values.empty() ? 0.0 : quantile(values, share);
}

double per(std::size_t count, std::size_t all) {
  return static_cast<double>(count) / static_cast<double>(std::max<std::size_t>(1, all));
}

/// One scene over all seeds: the share of all lit frames, and that of the worst seed.
void print_scene(std::size_t index, Seeds seeds, SpotDetectorKind detector) {
  VisionScore sum;
  double worst = 100.0;
  std::string name;
  for (unsigned seed = seeds.first; seed <= seeds.last; ++seed) {
    VisionScene scene = vision_scenes(seed)[index];
    scene.detector = detector;
    const VisionScore score = score_vision(scene);
    name = scene.name;
    worst = std::min(worst, score.right_percent());
    sum.add(score);
  }
  std::printf("%-28s %6zu %6.2f %6.2f %6.2f %6zu %6zu %5zu/%-5zu %7.2f %6.2f %6.2f %5zu %5.2f",
              name.c_str(), sum.lit, sum.right_percent(), worst,
              100.0 * per(sum.predicted, sum.lit), sum.wrong, sum.astray, sum.unnamed_returns,
              sum.returns, per(sum.false_spots, sum.pictures), share_of(sum.errors_px, 0.5),
              share_of(sum.errors_px, 0.99), sum.never, sum.slowest_s);
  std::printf("  %3.0f..%3.0f %7.0f\n", share_of(sum.peaks, 0.05), share_of(sum.peaks, 0.95),
              sum.board_s);
  std::fflush(stdout);
}

void print_rings(const char* name, RingPictures rings) {
  RingScore sum;
  for (const unsigned seed : {11U, 12U, 13U}) {
    rings.seed = seed;
    const RingScore score = score_rings(rings);
    sum.pictures += score.pictures;
    sum.one_spot += score.one_spot;
    sum.centered += score.centered;
    for (const double error : score.distance_errors)
      sum.distance_errors.push_back(100.0 * std::abs(error));
  }
  const auto off = static_cast<std::size_t>(
      std::ranges::count_if(sum.distance_errors, [](double percent) { return percent > 5.0; }));
  std::printf("%-40s %5d  %6.2f  %6.2f  %6.1f %6.2f %6.2f %6.2f\n", name, sum.pictures,
              100.0 * sum.one_spot / sum.pictures, 100.0 * sum.centered / sum.pictures,
              100.0 * per(sum.distance_errors.size(), static_cast<std::size_t>(sum.pictures)),
              share_of(sum.distance_errors, 0.5), share_of(sum.distance_errors, 0.95),
              100.0 * per(off, sum.distance_errors.size()));
  std::fflush(stdout);
}

void print_all_rings() {
  std::printf("%-40s %5s  %6s  %6s  %6s %6s %6s %6s\n", "single pictures", "n", "one %", "cent.%",
              "sized%", "med %", "95 %", "> 5 %");
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

Seeds seeds_of(std::string_view argument) {
  Seeds seeds;
  const std::string text(argument.substr(argument.find('=') + 1));
  char* rest = nullptr;
  seeds.first = seeds.last = static_cast<unsigned>(std::strtoul(text.c_str(), &rest, 10));
  if (*rest == '-') seeds.last = static_cast<unsigned>(std::strtoul(rest + 1, nullptr, 10));
  return seeds;
}

}  // namespace
}  // namespace crepes::study

int main(int argc, char** argv) {
  using namespace crepes::study;
  Seeds seeds;
  auto detector = crepes::SpotDetectorKind::kFast;
  std::vector<std::string_view> parts;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument.starts_with("seeds=")) {
      seeds = seeds_of(argument);
    } else if (argument == "detector=hough") {
      detector = crepes::SpotDetectorKind::kHough;
    } else {
      parts.push_back(argument);
    }
  }
  const auto is_wanted = [&](std::string_view name) {
    return parts.empty() || std::ranges::any_of(parts, [&](std::string_view part) {
             return name.find(part) != std::string_view::npos;
           });
  };
  if (is_wanted("rings")) print_all_rings();
  std::printf("%-28s %6s %6s %6s %6s %6s %6s %11s %7s %6s %6s %5s %5s  %8s %7s\n", "scene", "lit",
              "right%", "worst%", "pred.%", "wrong", "astray", "unnamed", "false", "med px",
              "p99 px", "never", "ID s", "peaks", "board s");
  const std::vector<VisionScene> scenes = vision_scenes(seeds.first);
  for (std::size_t i = 0; i < scenes.size(); ++i)
    if (is_wanted(scenes[i].name)) print_scene(i, seeds, detector);
  return 0;
}
