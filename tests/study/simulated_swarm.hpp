/// Swarms of the simulated world as recordings, in memory: what the recorded data sets are like,
/// with other luck for every seed.
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "config/schema/config.hpp"
#include "daemon/ctl/demo/demo_swarm.hpp"
#include "drivers/sim/board_renderer.hpp"
#include "drivers/sim/world.hpp"
#include "tests/study/obstacles.hpp"
#include "tests/study/pair_bound.hpp"
#include "tests/study/pair_sightings.hpp"
#include "tests/study/simulated_ranges.hpp"
#include "tests/study/simulated_spots.hpp"

namespace crepes::study {

/// A kind of recording.
struct Scenario {
  std::string_view name;
  SimScenario world = SimScenario::kTwo;
  NetworkModel network{.latency_ms = 3.0, .jitter_ms = 3.0, .loss = 0.02, .seed = 0};
  bool interference = false;  ///< glints, mains lamps, mirror images in the floor
  Obstacles obstacles = Obstacles::kNone;
  bool hides_images = true;  ///< what hides a robot hides its mirror image, too
  Darkness dark{};
  RangeModel ranges = RangeModel::kSimulated;
  /// One sigma of each pair's constant [m], which the robots know; empty: the simulated world's.
  std::optional<double> range_bias_m{};
  bool rests = false;    ///< four robots stand on a floor, in place of `world`
  double sight_m = 1e3;  ///< no camera sees further
  RobotId blind{};       ///< the cameras of this robot see nothing
  RobotId rangeless{};   ///< this robot has no UWB module
  /// Spots are what the detector finds in rendered pictures of such boards, without disturbances.
  std::optional<LedBoard> pictured{};
  bool are_boards_measured = false;  ///< robots know their size, within 2 %
};

inline constexpr std::array kScenarios{
    Scenario{.name = "static", .world = SimScenario::kStatic},
    Scenario{.name = "manual", .world = SimScenario::kTwo},
    Scenario{.name = "near", .world = SimScenario::kNear},
    Scenario{.name = "four", .world = SimScenario::kFour},
    Scenario{.name = "long-range", .world = SimScenario::kLongRange},
    Scenario{.name = "aggressive", .world = SimScenario::kAggressive},
    Scenario{.name = "occluded", .world = SimScenario::kOccluded},
    Scenario{.name = "interference", .world = SimScenario::kFour, .interference = true},
    Scenario{.name = "bad-network",
             .world = SimScenario::kFour,
             .network = {.latency_ms = 5.0, .jitter_ms = 60.0, .loss = 0.33, .seed = 0}},
    Scenario{
        .name = "cluttered", .world = SimScenario::kFour, .obstacles = Obstacles::kThinPillars},
    Scenario{.name = "fence", .world = SimScenario::kFour, .obstacles = Obstacles::kFence},
    Scenario{
        .name = "blackout", .world = SimScenario::kFour, .dark = {.from_s = 15.0, .to_s = 30.0}},
    Scenario{.name = "rest", .range_bias_m = 0.2, .rests = true},
    Scenario{.name = "blind", .world = SimScenario::kFour, .blind = RobotId{4}},
    Scenario{.name = "blind-pair", .world = SimScenario::kTwo, .blind = RobotId{2}},
    Scenario{.name = "rangeless", .world = SimScenario::kFour, .rangeless = RobotId{4}},
    Scenario{.name = "thin-ranges", .world = SimScenario::kFour, .ranges = RangeModel::kLinkTrack},
    Scenario{.name = "thin-pair", .world = SimScenario::kTwo, .ranges = RangeModel::kLinkTrack},
    Scenario{.name = "workshop",
             .world = SimScenario::kFour,
             .network = {.latency_ms = 5.0, .jitter_ms = 60.0, .loss = 0.33, .seed = 0},
             .interference = true,
             .obstacles = Obstacles::kThinPillars},
    Scenario{.name = "glass",
             .world = SimScenario::kFour,
             .interference = true,
             .obstacles = Obstacles::kThinPillars,
             .hides_images = false}};

/// What constants of the scenario's sensors are drawn from.
[[nodiscard]] SensorPriors priors_of(const Scenario& scenario);

/// All errors are drawn anew from `seed`: biases and scales of both IMUs, misalignment and
/// principal point of each camera, range bias of each pair, noise, outliers, drop-outs, the
/// network. Magnitudes are those that SensorPriors says; spots come from projections, not pictures.
[[nodiscard]] Swarm simulate_swarm(const Scenario& scenario, int seed, double duration_s);

/// The same of other robots in another world.
[[nodiscard]] Swarm simulate_swarm(const Scenario& scenario, const SimWorld& world,
                                   std::vector<DemoRobot> robots, double duration_s);

}  // namespace crepes::study
