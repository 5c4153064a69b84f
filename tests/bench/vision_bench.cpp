// What a frame costs, each figure over 32 different frames in memory, on one thread. The detector
// is held against the least that any detector could do: read every pixel once (BM_SumOfBytes).
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>

#include "estimator/vision/blink_tracker.hpp"
#include "estimator/vision/spot_detector.hpp"

namespace crepes {
namespace {

constexpr int kWidth = 1280;
constexpr int kHeight = 1024;
constexpr std::size_t kFrames = 32;

using Pixels = std::vector<std::uint8_t>;

/// A dim noisy background with four rings of six LEDs and ten lamps.
Pixels render(unsigned seed) {
  std::mt19937 random(seed);
  Pixels pixels(kWidth * kHeight);
  for (auto& p : pixels) p = static_cast<std::uint8_t>(4U + random() % 5U);
  const auto led = [&](double u, double v) {
    for (int y = static_cast<int>(v) - 4; y <= static_cast<int>(v) + 4; ++y)
      for (int x = static_cast<int>(u) - 4; x <= static_cast<int>(u) + 4; ++x) {
        auto& p = pixels[static_cast<std::size_t>(y * kWidth + x)];
        const double light = 400.0 * std::exp(-(std::pow(x - u, 2) + std::pow(y - v, 2)) / 2.0);
        p = static_cast<std::uint8_t>(std::min(255.0, p + light));
      }
  };
  const auto place = [&](int most) {
    return 120.0 + static_cast<double>(random() % unsigned(most));
  };
  for (const double radius : {40.0, 10.0, 4.0, 1.5}) {
    const double u = place(kWidth - 240);
    const double v = place(kHeight - 240);
    for (int k = 0; k < 6; ++k)
      led(u + radius * std::cos(k * std::numbers::pi / 3),
          v + radius * std::sin(k * std::numbers::pi / 3));
  }
  for (int i = 0; i < 10; ++i) led(place(kWidth - 240), place(kHeight - 240));
  return pixels;
}

const std::array<Pixels, kFrames>& frames() {
  static const std::array<Pixels, kFrames> kRendered = [] {
    std::array<Pixels, kFrames> all;
    for (unsigned i = 0; i < kFrames; ++i) all[i] = render(i);
    return all;
  }();
  return kRendered;
}

void BM_SumOfBytes(benchmark::State& state) {
  const auto& rendered = frames();
  std::size_t i = 0;
  for (auto _ : state) {
    std::uint64_t sum = 0;
    const Pixels& pixels = rendered[i++ % kFrames];
    for (int v = 0; v < kHeight; ++v) {
      const std::uint8_t* row = pixels.data() + v * kWidth;
      std::uint32_t row_sum = 0;
      for (int u = 0; u < kWidth; ++u) row_sum += row[u];
      sum += row_sum;
    }
    benchmark::DoNotOptimize(sum);
  }
}
BENCHMARK(BM_SumOfBytes)->Unit(benchmark::kMicrosecond);

void detect(benchmark::State& state, SpotDetectorKind kind) {
  VisionConfig config;
  config.detector = kind;
  SpotDetector detector(config);
  std::size_t i = 0;
  std::size_t spots = 0;
  for (auto _ : state) {
    const Pixels& pixels = frames()[i++ % kFrames];
    spots += detector.detect({pixels.data(), kWidth, kHeight, kWidth}).spots.size();
  }
  state.counters["spots"] = static_cast<double>(spots) / static_cast<double>(i);
}
void BM_DetectFast(benchmark::State& state) { detect(state, SpotDetectorKind::kFast); }
void BM_DetectHough(benchmark::State& state) { detect(state, SpotDetectorKind::kHough); }
BENCHMARK(BM_DetectFast)->Unit(benchmark::kMicrosecond);
BENCHMARK(BM_DetectHough)->Unit(benchmark::kMicrosecond);

cv::Mat binary_of(const Pixels& pixels) {
  const cv::Mat gray(kHeight, kWidth, CV_8UC1, const_cast<std::uint8_t*>(pixels.data()));
  cv::Mat binary;
  cv::threshold(gray, binary, 30, 255, cv::THRESH_BINARY);
  return binary;
}

void BM_FindContours(benchmark::State& state) {
  cv::setNumThreads(1);
  std::size_t i = 0;
  for (auto _ : state) {
    std::vector<std::vector<cv::Point>> contours;
    cv::findContours(binary_of(frames()[i++ % kFrames]), contours, cv::RETR_EXTERNAL,
                     cv::CHAIN_APPROX_NONE);
    for (const auto& contour : contours) benchmark::DoNotOptimize(cv::moments(contour));
  }
}
BENCHMARK(BM_FindContours)->Unit(benchmark::kMicrosecond);

void BM_ConnectedComponents(benchmark::State& state) {
  cv::setNumThreads(1);
  std::size_t i = 0;
  for (auto _ : state) {
    cv::Mat labels;
    cv::Mat stats;
    cv::Mat centroids;
    benchmark::DoNotOptimize(cv::connectedComponentsWithStats(binary_of(frames()[i++ % kFrames]),
                                                              labels, stats, centroids));
  }
}
BENCHMARK(BM_ConnectedComponents)->Unit(benchmark::kMicrosecond);

/// One frame of 20 boards, of a library of 64 with 20 slots each.
void BM_TrackTwentyBoards(benchmark::State& state) {
  std::mt19937 random(1);
  SwarmConfig swarm;
  while (swarm.members.size() < 64) {
    MemberConfig member;
    member.id = RobotId{static_cast<std::uint16_t>(swarm.members.size() + 1)};
    member.pattern = std::string(20, '1');
    for (int i = 0; i < 7; ++i) (*member.pattern)[random() % 20U] = '0';
    swarm.members.push_back(member);
    if (!IdLibrary::from(swarm)) swarm.members.pop_back();
  }
  const IdLibrary library = *IdLibrary::from(swarm);
  CameraConfig camera;
  camera.intrinsics = {-0.1723, 0.5931, 316.9, 316.8, 638.2, 512.5};
  camera.resolution = {kWidth, kHeight};
  BlinkTracker tracker(camera, *CameraModel::from(camera), VisionConfig{}, library);
  Timestamp now{};
  for (auto _ : state) {
    now += Duration{5'000'000};
    SpotFrame frame;
    frame.stamp = now;
    for (std::size_t i = 0; i < 20; ++i)
      if (library.entries()[i].code.is_lit(now.time_since_epoch()))
        frame.spots.push_back({200.0 + 150.0 * static_cast<double>(i % 5),
                               200.0 + 150.0 * static_cast<double>(i / 5), 12.0, 255.0, 1.0});
    benchmark::DoNotOptimize(tracker.step(frame));
  }
  state.counters["identified"] = static_cast<double>(tracker.status().identified);
}
BENCHMARK(BM_TrackTwentyBoards)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace crepes
