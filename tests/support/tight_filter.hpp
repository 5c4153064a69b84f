/// The tight filter, run over what a simulated pair measures.
#pragma once

#include <limits>

#include "tests/support/simulated_pair.hpp"

namespace crepes::test {

inline constexpr double kNoGate = std::numeric_limits<double>::infinity();

inline constexpr Duration kStart = std::chrono::milliseconds{50};

inline RawPose first_raw_pose(SimulatedPair& pair, Timestamp t) {
  return std::get<RawPose>(compute_raw_pose(pair.sighting(t)));
}

/// Bearings of both at 50 Hz, ranges at 25 Hz.
inline void run(NeighborFilter& filter, SimulatedPair& pair, Duration duration) {
  for (const Timestamp end = filter.stamp() + duration; filter.stamp() < end;) {
    const Timestamp t = filter.stamp() + std::chrono::milliseconds{10};
    pair.sample_imus(t);
    filter.advance_to(t, pair.imu_B, pair.imu_N);
    const auto tick = t.time_since_epoch() / std::chrono::milliseconds{10};
    if (tick % 2 == 0) {
      static_cast<void>(filter.fuse_bearing(pair.bearing(t), pair.mounting_N.led, kNoGate));
      static_cast<void>(
          filter.fuse_peer_bearing(pair.peer_bearing(t), pair.mounting_B.led, kNoGate));
    }
    if (tick % 4 == 1) {
      static_cast<void>(filter.fuse_range(pair.range(t), pair.mounting_B.antenna,
                                          pair.mounting_N.antenna, kNoGate));
    }
  }
}

/// Runs the tight filter from `first` at `kStart`.
inline NeighborFilter tight_filter(SimulatedPair& pair, const RawPose& first, Duration duration) {
  pair.sample_imus(Timestamp{kStart});
  NeighborFilter filter(Timestamp{kStart}, first, pair.process_noise(), pair.priors());
  run(filter, pair, duration);
  return filter;
}

inline NeighborFilter tight_filter(SimulatedPair& pair, Duration duration) {
  return tight_filter(pair, first_raw_pose(pair, Timestamp{kStart}), duration);
}

template <class Filter>
Vector6d pose_error(const SimulatedPair& pair, const Filter& filter) {
  return pose_difference(filter.motion().T_B_N, pair.truth(filter.stamp()).motion.T_B_N);
}

}  // namespace crepes::test
