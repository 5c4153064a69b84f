/// Time as data: time points that cannot read a clock.
#pragma once

#include <chrono>
#include <cstdint>
#include <limits>

namespace crepes {

/// Nanoseconds, signed 64 bit: 292 years around the epoch of the robot's clock.
using Duration = std::chrono::duration<std::int64_t, std::nano>;

/// This robot's timeline. It has no `now()`: stamps are taken at the edge (see clock.hpp).
struct MonoClock {
  using rep = std::int64_t;
  using period = std::nano;
  using duration = Duration;
  using time_point = std::chrono::time_point<MonoClock>;
  static constexpr bool is_steady = true;  // NOLINT(readability-identifier-naming): std's name
};

/// A neighbor's timeline. Its stamps do not mix with ours: only `ClockOffset` bridges the two.
struct PeerClock {
  using rep = std::int64_t;
  using period = std::nano;
  using duration = Duration;
  using time_point = std::chrono::time_point<PeerClock>;
  static constexpr bool is_steady = true;  // NOLINT(readability-identifier-naming): std's name
};

using Timestamp = MonoClock::time_point;
using PeerTimestamp = PeerClock::time_point;

/// Long before any stamp, yet safe to subtract from one. Clocks may be negative: zero is no such
/// time.
inline constexpr Timestamp kNever{Duration{std::numeric_limits<std::int64_t>::min() / 4}};

/// As a floating point number [s].
[[nodiscard]] constexpr double to_seconds(Duration d) {
  return static_cast<double>(d.count()) * 1e-9;
}

/// Rounds towards zero; the argument must lie within +-9e9 s.
[[nodiscard]] constexpr Duration from_seconds(double seconds) {
  return Duration{static_cast<std::int64_t>(seconds * 1e9)};
}

/// Nanoseconds since the zero of the clock.
template <class Clock>
[[nodiscard]] constexpr std::int64_t to_ns(std::chrono::time_point<Clock, Duration> t) {
  return t.time_since_epoch().count();
}

}  // namespace crepes
