#include "tests/study/crowd.hpp"

#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "drivers/sim/seeded_noise.hpp"
#include "estimator/core/contract.hpp"
#include "estimator/vision/codebook.hpp"

namespace crepes::study {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::uint64_t kCrowdKey = 0x63726f7764U;

RobotId id_of(std::size_t index) { return RobotId{static_cast<std::uint16_t>(index + 1)}; }

/// Two sines about `offset`, the second smaller and faster; `draw` counts what was drawn.
Wave wander(const SeededNoise& noise, std::uint64_t& draw, double offset, double amplitude,
            double frequency_hz) {
  const auto sine = [&](double share, double factor) {
    const double stretch = 0.8 + 0.4 * noise.uniform(draw++);
    return Wave::Sine{share * amplitude, 2 * kPi * frequency_hz * factor * stretch,
                      2 * kPi * noise.uniform(draw++)};
  };
  return {.offset = offset, .sines = {sine(0.75, 1.0), sine(0.25, 2.3)}};
}

Motion motion_of(const Crowd& crowd, std::size_t index, int seed) {
  const SeededNoise noise{kCrowdKey, static_cast<std::uint64_t>(seed), index};
  std::uint64_t draw = 0;
  const std::size_t ring = index % crowd.rings;
  const auto in_ring = static_cast<double>((crowd.robots - ring + crowd.rings - 1) / crowd.rings);
  const double bearing = 2 * kPi * static_cast<double>(index / crowd.rings) / in_ring;
  const double x =
      crowd.distance_m * static_cast<double>(ring) + crowd.radius_m * std::cos(bearing);
  const double height = 1.4 + crowd.spread_m * noise.uniform(draw++);
  Motion motion = {.rule = AttitudeRule::kThrust,
                   .x = wander(noise, draw, x, 0.6, 0.17),
                   .y = wander(noise, draw, crowd.radius_m * std::sin(bearing), 0.6, 0.17),
                   .z = wander(noise, draw, height, 0.35, 0.13),
                   .yaw = wander(noise, draw, bearing + kPi, 20 * kPi / 180, 0.12),
                   .pitch = {},
                   .roll = {}};
  if (crowd.meeting_s > 0.0) {
    const double half = 0.5 * (crowd.distance_m - crowd.nearest_m) * static_cast<double>(ring);
    motion.x.offset -= half;
    motion.x.sines.push_back({half, kPi / crowd.meeting_s, 0.5 * kPi});
  }
  return motion;
}

/// Like a robot of the demo, with patterns for all.
std::vector<DemoRobot> robots_of(const Crowd& crowd, int seed) {
  const DemoRobot model = demo_swarm({}, {RobotId{1}}, 0.0, 40000, 40100).front();
  const Codebook book = search_codebook({.slots = crowd.robots > 20 ? 22U : 18U}, crowd.robots);
  CREPES_EXPECT(book.patterns.size() == crowd.robots, "there are patterns for all");
  SwarmConfig swarm = model.config.swarm;
  const MemberConfig member = swarm.members.front();
  swarm.members.clear();
  for (std::size_t i = 0; i < crowd.robots; ++i) {
    swarm.members.push_back(member);
    swarm.members.back().id = id_of(i);
    swarm.members.back().name = "r" + std::to_string(i + 1);
    swarm.members.back().pattern = book.patterns[i];
  }
  std::vector<DemoRobot> robots(crowd.robots, model);
  for (std::size_t i = 0; i < crowd.robots; ++i) {
    const SeededNoise noise{kCrowdKey, static_cast<std::uint64_t>(seed), i, 1};
    robots[i].config.robot.id = id_of(i);
    robots[i].config.swarm = swarm;
    robots[i].config.uwb.noise.max_range_m = crowd.sight_m;
    robots[i].clock = {crowd.clocks_s + 50 * noise.uniform(0), 15 * noise.gaussian(1)};
  }
  return robots;
}

}  // namespace

Swarm simulate_crowd(const Crowd& crowd, int seed, double duration_s) {
  std::map<RobotId, Motion> motions;
  for (std::size_t i = 0; i < crowd.robots; ++i)
    motions.emplace(id_of(i), motion_of(crowd, i, seed));
  const Scenario scenario{.name = "crowd", .dark = crowd.dark, .sight_m = crowd.sight_m};
  return simulate_swarm(scenario, SimWorld(seed, std::move(motions)), robots_of(crowd, seed),
                        duration_s);
}

}  // namespace crepes::study
