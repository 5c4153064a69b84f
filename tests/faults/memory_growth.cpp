/// memory_growth: what a swarm of four keeps in memory after flights of different lengths, under
/// attack all the time. See README.md.
#include <fmt/core.h>
#include <malloc.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <optional>
#include <vector>

#include "daemon/ctl/replay/virtual_swarm.hpp"
#include "tests/faults/network_faults.hpp"
#include "tests/study/simulated_swarm.hpp"

namespace crepes::faults {
namespace {

std::uint64_t heap_in_use() {
  const struct mallinfo2 heap = ::mallinfo2();
  return heap.uordblks + heap.hblkhd;
}

/// Floods, copies, replays, a second r2 and a lying r3, ten seconds each in turn.
std::vector<Fault> attacks(double duration_s) {
  constexpr double kEach_s = 10.0;
  constexpr std::array kAttacks{Kind::kGarbageFlood, Kind::kForgedFlood,  Kind::kReplay,
                                Kind::kDoubledId,    Kind::kLiarExtremes, Kind::kJitter};
  std::vector<Fault> faults;
  for (double t = 0.0; t < duration_s; t += kEach_s) {
    const std::size_t turn = faults.size();
    faults.push_back({.kind = kAttacks.at(turn % kAttacks.size()),
                      .robot = RobotId{static_cast<std::uint16_t>(1 + turn % 4)},
                      .from_s = t,
                      .to_s = t + kEach_s,
                      .rate = 0.5,
                      .seed = turn});
  }
  return faults;
}

/// Bytes of the robots' state after such a flight.
std::uint64_t state_after(double duration_s) {
  const auto& four = *std::ranges::find(study::kScenarios, "four", &study::Scenario::name);
  const study::Swarm swarm = study::simulate_swarm(four, 1, duration_s);
  const std::vector<Fault> faults = attacks(duration_s);
  FaultyNetwork network(true);
  network.strike(faults);
  Liars liars(faults);
  ReplaySinks sinks;
  sinks.on_pose = [](RobotId, const NeighborPose&) {};
  sinks.on_delivery = [&](RobotId from, RobotId to, double sent_s,
                          std::vector<Delivery>& deliveries) {
    network(from, to, sent_s, deliveries);
  };
  double now_s = 0.0;
  sinks.on_report = [&](Report& report) { liars(now_s, report); };
  ReplayOptions options;
  options.sealed = true;
  const std::optional<SwarmTruth> no_truth;
  const std::uint64_t before = heap_in_use();
  VirtualSwarm flight(swarm.dataset, no_truth, options, sinks);
  for (; now_s < duration_s; now_s += 1.0)
    if (!flight.run_until(now_s)) return 0;
  return heap_in_use() - before;
}

}  // namespace
}  // namespace crepes::faults

int main() {
  constexpr std::array kDurations_s{30.0, 90.0, 300.0};
  std::vector<double> states;
  for (const double duration_s : kDurations_s) {
    states.push_back(static_cast<double>(crepes::faults::state_after(duration_s)));
    fmt::print("{:4.0f} s: {:.3f} MB\n", duration_s, 1e-6 * states.back());
    std::fflush(stdout);
  }
  const double per_s = (states[2] - states[1]) / (kDurations_s[2] - kDurations_s[1]);
  fmt::print("from the last two: {:+.3f} MB an hour\n", 1e-6 * per_s * 3600.0);
  return 0;
}
