// What finding spots costs, each figure over 32 different frames in memory, on one thread, all in
// one run; the table at the end gives the ratios of the medians. The detector is held against the
// least that any detector must do: read every pixel once.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>
#include <string>

#include "estimator/vision/spot_detector.hpp"

namespace crepes {
namespace {

constexpr int kWidth = 1280;
constexpr int kHeight = 1024;
constexpr std::size_t kFrames = 32;

using Pixels = std::vector<std::uint8_t>;
using Frames = std::array<Pixels, kFrames>;

void add_led(Pixels& pixels, double u, double v) {
  for (int y = static_cast<int>(v) - 4; y <= static_cast<int>(v) + 4; ++y) {
    for (int x = static_cast<int>(u) - 4; x <= static_cast<int>(u) + 4; ++x) {
      auto& p = pixels[static_cast<std::size_t>(y * kWidth + x)];
      const double light = 400.0 * std::exp(-(std::pow(x - u, 2) + std::pow(y - v, 2)) / 2.0);
      p = static_cast<std::uint8_t>(std::min(255.0, p + light));
    }
  }
}

/// A dim background with noise of `noise` gray levels, four rings of six LEDs and so many lamps.
Pixels render(unsigned seed, unsigned lamps = 10, unsigned noise = 5) {
  std::mt19937 random(seed);
  Pixels pixels(kWidth * kHeight);
  for (auto& p : pixels) p = static_cast<std::uint8_t>(4U + random() % noise);
  const auto place = [&](int most) {
    return 60.0 + static_cast<double>(random() % unsigned(most - 120)) + 1e-3 * (random() % 1000U);
  };
  for (const double radius : {40.0, 10.0, 4.0, 1.5}) {
    const double u = place(kWidth);
    const double v = place(kHeight);
    for (int k = 0; k < 6; ++k)
      add_led(pixels, u + radius * std::cos(k * std::numbers::pi / 3),
              v + radius * std::sin(k * std::numbers::pi / 3));
  }
  for (unsigned i = 0; i < lamps; ++i) add_led(pixels, place(kWidth), place(kHeight));
  return pixels;
}

/// The same with a window of uneven brightness in a third of the picture.
Pixels with_window(unsigned seed) {
  Pixels pixels = render(seed);
  std::mt19937 random(seed);
  for (int v = 200; v < 900; ++v)
    for (int u = 500; u < 1100; ++u)
      pixels[static_cast<std::size_t>(v * kWidth + u)] =
          static_cast<std::uint8_t>(150 + u / 20 + int(random() % 9U));
  return pixels;
}

Pixels with_sun(unsigned seed) {
  Pixels pixels = render(seed);
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u)
      if (std::hypot(u - 800, v - 500) < 420)
        pixels[static_cast<std::size_t>(v * kWidth + u)] = 255;
  return pixels;
}

Pixels white(unsigned) { return Pixels(kWidth * kHeight, 255); }

/// Nothing but noise: every other pixel stands out.
Pixels salt(unsigned seed) {
  std::mt19937 random(seed);
  Pixels pixels(kWidth * kHeight);
  for (auto& p : pixels) p = random() % 2U == 0 ? 0 : 255;
  return pixels;
}

/// As much noise as the detector can be bothered with.
Pixels sparse_salt(unsigned seed) {
  std::mt19937 random(seed);
  Pixels pixels(kWidth * kHeight);
  for (auto& p : pixels) p = random() % 50U == 0 ? 255 : 4;
  return pixels;
}

template <class Render>
Frames all_of(const Render& one) {
  Frames frames;
  for (unsigned i = 0; i < kFrames; ++i) frames[i] = one(i);
  return frames;
}

struct Scene {
  const char* name;
  std::function<Pixels(unsigned)> render;
};
const std::array kScenes{
    Scene{"boards", [](unsigned seed) { return render(seed); }},
    Scene{"noisy", [](unsigned seed) { return render(seed, 10, 60); }},
    Scene{"lamps300", [](unsigned seed) { return render(seed, 300); }},
    Scene{"window", with_window},
    Scene{"sun", with_sun},
    Scene{"white", white},
    Scene{"salt", salt},
    Scene{"sparse_salt", sparse_salt},
};

/// The frames of one scene at a time.
const Frames& frames_of(const Scene& scene) {
  static const Scene* current = nullptr;
  static Frames frames;
  if (current != &scene) frames = all_of(scene.render);
  current = &scene;
  return frames;
}

std::uint64_t sum_of_bytes(const Pixels& pixels) {
  // Sums of 16 bits for as long as they hold: twice as many additions at once as with 32.
  constexpr std::size_t kLanes = 64;
  constexpr std::size_t kBlock = kLanes * 256;
  static_assert(kWidth * kHeight % kBlock == 0);
  std::uint64_t sum = 0;
  for (std::size_t block = 0; block < pixels.size(); block += kBlock) {
    std::array<std::uint16_t, kLanes> lanes{};
    for (std::size_t i = 0; i < kBlock; i += kLanes)
      for (std::size_t k = 0; k < kLanes; ++k)
        lanes[k] = static_cast<std::uint16_t>(lanes[k] + pixels[block + i + k]);
    for (const std::uint16_t lane : lanes) sum += lane;
  }
  return sum;
}

/// Sums with 32 bits, the loop that one writes first.
std::uint64_t plain_sum_of_bytes(const Pixels& pixels) {
  std::uint64_t sum = 0;
  for (std::size_t v = 0; v < kHeight; ++v) {
    std::uint32_t row = 0;
    for (std::size_t u = 0; u < kWidth; ++u) row += pixels[v * kWidth + u];
    sum += row;
  }
  return sum;
}

class Detector {
 public:
  explicit Detector(SpotDetectorKind kind)
      : detector_([&] {
          VisionConfig config;
          config.detector = kind;
          return config;
        }()) {}
  std::uint64_t operator()(const Pixels& pixels) {
    return detector_.detect({pixels.data(), kWidth, kHeight, kWidth}).spots.size();
  }

 private:
  SpotDetector detector_;
};

cv::Mat gray_of(const Pixels& pixels) {
  return {kHeight, kWidth, CV_8UC1, const_cast<std::uint8_t*>(pixels.data())};
}

/// Memory is kept from frame to frame, as a careful user of OpenCV would.
class Contours {
 public:
  std::uint64_t operator()(const Pixels& pixels) {
    cv::threshold(gray_of(pixels), binary_, 30, 255, cv::THRESH_BINARY);
    cv::findContours(binary_, contours_, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
    for (const auto& contour : contours_) benchmark::DoNotOptimize(cv::moments(contour));
    return contours_.size();
  }

 private:
  cv::Mat binary_;
  std::vector<std::vector<cv::Point>> contours_;
};

class Components {
 public:
  std::uint64_t operator()(const Pixels& pixels) {
    cv::threshold(gray_of(pixels), binary_, 30, 255, cv::THRESH_BINARY);
    return static_cast<std::uint64_t>(
        cv::connectedComponentsWithStats(binary_, labels_, stats_, centroids_));
  }

 private:
  cv::Mat binary_, labels_, stats_, centroids_;
};

template <class Work>
void over_frames(benchmark::State& state, const Scene& scene, Work work) {
  const Frames& frames = frames_of(scene);
  std::size_t i = 0;
  std::uint64_t found = 0;
  for (const Pixels& pixels : frames) benchmark::DoNotOptimize(work(pixels));
  for (auto _ : state) {
    const std::uint64_t count = work(frames[i++ % kFrames]);
    benchmark::DoNotOptimize(count);
    found += count;
  }
  state.counters["found"] = static_cast<double>(found) / static_cast<double>(i);
}

/// Prints as usual, then the medians as multiples of the sum of bytes.
class RatioReporter : public benchmark::ConsoleReporter {
 public:
  void ReportRuns(const std::vector<Run>& runs) override {
    ConsoleReporter::ReportRuns(runs);
    for (const Run& run : runs)
      if (run.aggregate_name == "median")
        medians_[run.run_name.function_name] = run.GetAdjustedCPUTime();
  }

  void Finalize() override {
    const auto sum = medians_.find("boards/sum_of_bytes");
    if (sum == medians_.end()) return;
    std::printf("\nmedians of CPU time over the sum of bytes (%.1f us):\n", sum->second);
    for (const auto& [name, median] : medians_)
      std::printf("  %-28s %8.1f us  x %.2f\n", name.c_str(), median, median / sum->second);
    const auto hough = medians_.find("boards/hough");
    const auto ours = medians_.find("boards/detector");
    if (hough != medians_.end() && ours != medians_.end())
      std::printf("  the detector is %.0f times faster than hough\n", hough->second / ours->second);
  }

 private:
  std::map<std::string, double> medians_;
};

template <class Work>
void enlist(const Scene& scene, const std::string& what, const Work& make) {
  const std::string name = std::string(scene.name) + "/" + what;
  benchmark::RegisterBenchmark(
      name.c_str(), [&scene, make](benchmark::State& state) { over_frames(state, scene, make()); })
      ->Unit(benchmark::kMicrosecond)
      ->Repetitions(9)
      ->ReportAggregatesOnly(true);
}

void enlist_all() {
  for (const Scene& scene : kScenes) {
    if (&scene == &kScenes[0]) {
      enlist(scene, "sum_of_bytes", [] { return sum_of_bytes; });
      enlist(scene, "plain_sum_of_bytes", [] { return plain_sum_of_bytes; });
      enlist(scene, "hough", [] { return Detector(SpotDetectorKind::kHough); });
    }
    enlist(scene, "detector", [] { return Detector(SpotDetectorKind::kFast); });
    enlist(scene, "find_contours", [] { return Contours(); });
    enlist(scene, "connected_components", [] { return Components(); });
  }
}

}  // namespace
}  // namespace crepes

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  crepes::enlist_all();
  crepes::RatioReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
}
