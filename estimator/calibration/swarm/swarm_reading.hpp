/// What one robot of a swarm read of another, and when.
#pragma once

#include <cstddef>

#include "estimator/calibration/swarm/swarm_state.hpp"

namespace crepes {

/// A sighting or a range, and where both robots' intervals have it.
struct SwarmReading {
  std::size_t observer = 0;       ///< index of the robot
  std::size_t other = 0;          ///< index of the robot
  std::size_t index = 0;          ///< among the observer's sightings or ranges
  std::size_t observer_knot = 0;  ///< at which the observer's interval begins
  std::size_t other_knot = 0;     ///< at which the other's interval begins
  double stamp_s = 0.0;           ///< by the observer's IMU
  double common_s = 0.0;          ///< by the clock that all robots share
};

/// What the pair itself lengthens a range by [m]: its constant and its drift, without both delays.
[[nodiscard]] inline double pair_part_m(const SwarmState& state, const SwarmReading& reading) {
  const std::size_t pair = pair_index(reading.observer, reading.other, state.robots.size());
  return state.pair_bias_m[pair] + state.pair_drift_m[reading.observer_knot][pair];
}

}  // namespace crepes
