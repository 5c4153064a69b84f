// What tracking costs.
#include <benchmark/benchmark.h>

#include <random>

#include "estimator/vision/blink_tracker.hpp"

namespace crepes {
namespace {

constexpr int kWidth = 1280;
constexpr int kHeight = 1024;

/// One frame of 20 boards of a library of 64 with 20 slots each, among sources that are no boards.
void track(benchmark::State& state, std::size_t steady, std::size_t flickering) {
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
  CameraCalibration camera;
  camera.intrinsics = {-0.1723, 0.5931, 316.9, 316.8, 638.2, 512.5};
  camera.resolution = {kWidth, kHeight};
  BlinkTracker tracker(camera, *CameraModel::from(camera), VisionConfig{}, library);
  Timestamp now{};
  SpotFrame frame;
  for (auto _ : state) {
    now += Duration{5'000'000};
    frame.stamp = now;
    frame.spots.clear();
    for (std::size_t i = 0; i < 20 + steady + flickering; ++i) {
      const bool is_lit = i < 20 ? library.entries()[i].code.is_lit(now.time_since_epoch())
                                 : i < 20 + steady || random() % 4U > 0;
      if (is_lit)
        frame.spots.push_back({250.0 + 48.0 * static_cast<double>(i % 16),
                               180.0 + 48.0 * static_cast<double>(i / 16), 12.0, 255.0, 1.0});
    }
    benchmark::DoNotOptimize(tracker.step(frame));
  }
  state.counters["identified"] = static_cast<double>(tracker.status().identified);
  state.counters["tracks"] = static_cast<double>(tracker.status().tracks);
}
void BM_TrackTwentyBoards(benchmark::State& state) { track(state, 0, 0); }
void BM_TrackTwentyBoardsAmongLamps(benchmark::State& state) { track(state, 180, 0); }
void BM_TrackTwentyBoardsAmongFlicker(benchmark::State& state) { track(state, 0, 180); }
BENCHMARK(BM_TrackTwentyBoardsAmongLamps)->Unit(benchmark::kMicrosecond);
BENCHMARK(BM_TrackTwentyBoardsAmongFlicker)->Unit(benchmark::kMicrosecond);
BENCHMARK(BM_TrackTwentyBoards)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace crepes
