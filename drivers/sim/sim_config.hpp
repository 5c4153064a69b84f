/// Settings: a simulated world instead of devices.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "estimator/core/settings_schema.hpp"

namespace crepes {

/// The robots of the simulated world and their motions.
enum class SimScenario : std::uint8_t {
  kTwo,
  kFour,
  kLongRange,
  kAggressive,
  kOccluded,
  kLine,
  kStatic,
  kFormation,
  kNear,
};
inline constexpr std::array kSimScenarios{Choice{"two", SimScenario::kTwo},
                                          Choice{"four", SimScenario::kFour},
                                          Choice{"long-range", SimScenario::kLongRange},
                                          Choice{"aggressive", SimScenario::kAggressive},
                                          Choice{"occluded", SimScenario::kOccluded},
                                          Choice{"line", SimScenario::kLine},
                                          Choice{"static", SimScenario::kStatic},
                                          Choice{"formation", SimScenario::kFormation},
                                          Choice{"near", SimScenario::kNear}};

/// A simulated world instead of devices.
struct SimConfig {
  bool enabled = false;
  SimScenario scenario = SimScenario::kFour;
  int seed = 1;
  double epoch_s = 0.0;
  double clock_offset_s = 0.0;
  double clock_skew_ppm = 0.0;
  std::string track;

  [[nodiscard]] bool operator==(const SimConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("enabled", enabled, "replace all devices by a simulated world");
    v.choice("scenario", scenario, kSimScenarios, "the motion of the robots");
    v.field("seed", seed, Bounds{0, 2147483647},
            "the same seed gives the same world in every process");
    v.field("epoch_s", epoch_s, Bounds{0, 1e9},
            "the machine's monotonic time at which the world began");
    v.field("clock_offset_s", clock_offset_s, Bounds{-1e6, 1e6},
            "this robot's clock minus world time");
    v.field("clock_skew_ppm", clock_skew_ppm, Bounds{-200, 200},
            "rate error of this robot's clock");
    v.field(
        "track", track,
        "file with the motions of steered robots, which crepesctl demo writes; empty: they hover");
  }
};

}  // namespace crepes
