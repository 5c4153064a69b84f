/// memory_growth: what a swarm keeps in memory over hours under attack. See README.md.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>
#include <vector>

#include "daemon/ctl/replay/virtual_swarm.hpp"
#include "tests/faults/network_faults.hpp"
#include "tests/faults/sensor_faults.hpp"
#include "tests/study/crowd.hpp"
#include "tests/support/heap.hpp"

namespace crepes::faults {
namespace {

constexpr double kPiece_s = 60.0;
constexpr double kPause_s = 3.0;  // the robots stop, and are elsewhere when they go on

double heap_mb() { return 1e-6 * static_cast<double>(test::heap_bytes()); }

/// Floods, copies, replays, doubled ids and liars, ten seconds each in turn, each robot in turn.
std::vector<Fault> attacks(std::size_t robots, double from_s) {
  constexpr double kEach_s = 10.0;
  constexpr std::array kAttacks{Kind::kGarbageFlood, Kind::kForgedFlood,     Kind::kReplay,
                                Kind::kDoubledId,    Kind::kLiarExtremes,    Kind::kJitter,
                                Kind::kReplay,       Kind::kLiarWithinBounds};
  std::vector<Fault> faults;
  for (std::size_t i = 0; kEach_s * static_cast<double>(i) < kPiece_s; ++i) {
    const auto turn = i + static_cast<std::size_t>(std::lround(from_s / kEach_s));
    const double begin_s = from_s + kEach_s * static_cast<double>(i);
    faults.push_back({.kind = kAttacks.at(turn % kAttacks.size()),
                      .robot = RobotId{static_cast<std::uint16_t>(1 + turn % robots)},
                      .from_s = begin_s,
                      .to_s = begin_s + kEach_s,
                      .rate = 0.5,
                      .seed = turn});
  }
  return faults;
}

/// The light goes out for everybody for four seconds, so that boards come back where poses put
/// them.
std::vector<Fault> blackout(std::size_t robots, double from_s) {
  std::vector<Fault> faults;
  for (std::size_t i = 1; i <= robots; ++i) {
    faults.push_back({.kind = Kind::kCameraBlack,
                      .robot = RobotId{static_cast<std::uint16_t>(i)},
                      .from_s = from_s + 0.5 * kPiece_s,
                      .to_s = from_s + 0.5 * kPiece_s + 4.0,
                      .rate = 1.0,
                      .seed = i});
  }
  return faults;
}

SwarmDataset without_readings(SwarmDataset dataset) {
  for (RobotRecording& robot : dataset.robots) {
    robot.imu.clear();
    robot.ranges.clear();
    robot.cameras.clear();
  }
  return dataset;
}

/// A line through points.
struct Slope {
  double per_x = 0.0;
  double sigma = 0.0;
};
Slope slope_of(const std::vector<std::pair<double, double>>& points) {
  const auto n = static_cast<double>(points.size());
  double x = 0.0;
  double y = 0.0;
  for (const auto& [px, py] : points) {
    x += px / n;
    y += py / n;
  }
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
  for (const auto& [px, py] : points) {
    xx += (px - x) * (px - x);
    xy += (px - x) * (py - y);
    yy += (py - y) * (py - y);
  }
  if (n < 3 || xx == 0.0) return {};
  return {xy / xx, std::sqrt(std::max(0.0, yy - xy * xy / xx) / (n - 2) / xx)};
}

/// Flies the same minute again and again, and prints what the robots keep after each: readings and
/// datagrams that are on their way do not count.
int fly(std::size_t robots, double hours) {
  const study::Swarm swarm =
      study::simulate_crowd({.robots = robots, .radius_m = 3.0}, 1, kPiece_s);
  FaultyNetwork network(true);
  std::optional<Liars> liars;
  double now_s = 0.0;
  ReplaySinks sinks;
  sinks.on_pose = [](RobotId, const NeighborPose&) {};
  sinks.on_delivery = [&](RobotId from, RobotId to, double sent_s,
                          std::vector<Delivery>& deliveries) {
    network(from, to, sent_s, deliveries);
  };
  sinks.on_report = [&](Report& report) { (*liars)(now_s, report); };
  std::optional<SensorFaults> sensors;
  sinks.on_reading = [&](RobotId robot, double true_s, Event& event) {
    return (*sensors)(robot, true_s, event);
  };
  ReplayOptions options;
  options.sealed = true;
  const std::optional<SwarmTruth> no_truth;
  const double before_mb = heap_mb();
  VirtualSwarm flight(without_readings(swarm.dataset), no_truth, options, sinks);
  std::vector<std::pair<double, double>> kept;
  for (double from_s = 0.0; from_s < 3600.0 * hours; from_s += kPiece_s + kPause_s) {
    const std::vector<Fault> faults = attacks(robots, from_s);
    network.strike(faults);
    liars.emplace(faults);
    sensors.emplace(blackout(robots, from_s));
    flight.append(swarm.dataset, from_s);
    const double end_s = from_s + kPiece_s + kPause_s;
    for (; now_s < end_s; now_s += 1.0)
      if (!flight.run_until(now_s)) return 1;
    flight.take_clocks().clear();
    kept.emplace_back(end_s / 3600.0, heap_mb() - before_mb);
    fmt::print("{:7.3f} h: {:.3f} MB\n", kept.back().first, kept.back().second);
    std::fflush(stdout);
  }
  const std::vector later(kept.begin() + static_cast<std::ptrdiff_t>(kept.size() / 3), kept.end());
  const Slope slope = slope_of(later);
  fmt::print("after the first third: {:+.4f} MB an hour, sigma {:.4f}\n", slope.per_x, slope.sigma);
  return 0;
}

}  // namespace
}  // namespace crepes::faults

int main(int argc, char** argv) {
  CLI::App app{"What a swarm under attack keeps in memory", "memory_growth"};
  double hours = 0.5;
  std::size_t robots = 4;
  app.add_option("--hours", hours, "of simulated time")->capture_default_str();
  app.add_option("--robots", robots)->capture_default_str()->check(CLI::Range(2, 20));
  CLI11_PARSE(app, argc, argv);
  return crepes::faults::fly(robots, hours);
}
