/// Simulated swarms of any size, in one ring or in several.
#pragma once

#include <cstddef>

#include "tests/study/simulated_swarm.hpp"

namespace crepes::study {

/// Rings of multirotors that face the center of their ring, in a line.
struct Crowd {
  std::size_t robots = 20;
  std::size_t rings = 1;
  double radius_m = 8.0;     ///< of a ring
  double distance_m = 0.0;   ///< from one ring's center to the next
  double nearest_m = 0.0;    ///< the same when they have met
  double meeting_s = 0.0;    ///< which is then; afterwards they part again. 0: never
  double sight_m = 40.0;     ///< of cameras and UWB modules
  double spread_m = 1.0;     ///< of the heights about which robots fly
  double clocks_s = 1000.0;  ///< what their clocks show at the beginning, about
  Darkness dark{};
};

/// Noise, errors and network as in `simulate_swarm`. In rings of more than five robots, UWB modules
/// share their channel. Robot 1, 1 + rings, 1 + 2 rings ... are in the first ring, and so on.
[[nodiscard]] Swarm simulate_crowd(const Crowd& crowd, int seed, double duration_s);

}  // namespace crepes::study
