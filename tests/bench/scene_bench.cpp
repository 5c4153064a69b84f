// What finding spots costs in each scene of vision_study whose pictures differ, with twenty boards,
// on one thread. The table at the end gives the medians, and their ratios to a plain sum of bytes.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <cstdio>
#include <map>
#include <numeric>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/vision/spot_detector.hpp"
#include "tests/study/scene_pictures.hpp"

namespace crepes {
namespace {

constexpr int kWidth = 1280;
constexpr int kHeight = 1024;
constexpr std::size_t kBoards = 20;
constexpr std::size_t kPictures = 16;
constexpr std::string_view kSum = "sum of bytes";

using study::ScenePicture;

std::uint64_t sum_of_bytes(const ScenePicture& picture) {
  std::uint64_t sum = 0;
  for (std::size_t v = 0; v < kHeight; ++v) {
    const auto row = picture.begin() + static_cast<std::ptrdiff_t>(v * kWidth);
    sum += std::accumulate(row, row + kWidth, std::uint32_t{0});
  }
  return sum;
}

/// Hides, loses or swaps boards from picture to picture, so that single ones are like the others.
bool is_about_time(const study::VisionScene& scene) {
  return scene.is_hidden || scene.lost_share > 0.0 || scene.do_cross || scene.is_foreign;
}

template <class Work>
void over_pictures(benchmark::State& state, const std::vector<ScenePicture>& pictures, Work work) {
  std::uint64_t found = 0;
  std::size_t i = 0;
  // A map of hot pixels needs some seconds of pictures.
  for (; i < 100 * kPictures; ++i) benchmark::DoNotOptimize(work(pictures[i % kPictures]));
  std::size_t counted = 0;
  for (auto _ : state) {
    const std::uint64_t count = work(pictures[i++ % kPictures]);
    benchmark::DoNotOptimize(count);
    found += count;
    ++counted;
  }
  state.counters["found"] = static_cast<double>(found) / static_cast<double>(counted);
}

template <class Work>
void enlist(const std::string& name, const std::vector<ScenePicture>& pictures, const Work& make) {
  benchmark::RegisterBenchmark(
      name.c_str(),
      [&pictures, make](benchmark::State& state) { over_pictures(state, pictures, make()); })
      ->Unit(benchmark::kMicrosecond)
      ->Repetitions(9)
      ->ReportAggregatesOnly(true);
}

class Reporter : public benchmark::ConsoleReporter {
 public:
  void ReportRuns(const std::vector<Run>& runs) override {
    ConsoleReporter::ReportRuns(runs);
    for (const Run& run : runs)
      if (run.aggregate_name == "median")
        medians_[run.run_name.function_name] = {run.GetAdjustedCPUTime(),
                                                run.counters.at("found").value};
  }
  void Finalize() override {
    const auto sum = medians_.find(std::string(kSum));
    if (sum == medians_.end()) return;
    std::printf("\n%-28s %8s %8s %8s\n", "scene", "us", "ratio", "found");
    for (const auto& [name, median] : medians_)
      if (name != kSum)
        std::printf("%-28s %8.0f %8.2f %8.1f\n", name.c_str(), median.us,
                    median.us / sum->second.us, median.found);
  }

 private:
  struct Median {
    double us = 0.0;
    double found = 0.0;  ///< spots a picture
  };
  std::map<std::string, Median> medians_;
};

}  // namespace
}  // namespace crepes

int main(int argc, char** argv) {
  using namespace crepes;
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  std::map<std::string, std::vector<ScenePicture>> pictures;
  for (const study::VisionScene& scene : study::vision_scenes(1))
    if (!is_about_time(scene))
      pictures[scene.name] = study::scene_pictures(scene, kBoards, kPictures);
  enlist(std::string(kSum), pictures.at("clean"), [] { return sum_of_bytes; });
  for (const auto& [name, of_scene] : pictures) {
    enlist(name, of_scene, [] {
      return [detector = SpotDetector(VisionConfig{})](const ScenePicture& picture) mutable {
        return detector.detect({picture.data(), kWidth, kHeight, kWidth}).spots.size();
      };
    });
  }
  Reporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
}
