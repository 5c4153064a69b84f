/// Offset of a device's clock against ours, estimated from the arrivals of its stamps.
#pragma once

#include <cstdint>
#include <optional>

#include "estimator/core/bound_envelope.hpp"
#include "estimator/core/time.hpp"

namespace crepes {

/// A reading of a device's counter.
struct DeviceTime {
  std::uint64_t ns = 0;
  std::uint64_t wrap_ns = 0;  ///< where the counter wraps; 0: at the end of 64 bits

  /// A counter of `bits` bits, fewer than 64.
  [[nodiscard]] static constexpr DeviceTime ticks(std::uint64_t count, Duration tick,
                                                  unsigned bits) {
    const auto tick_ns = static_cast<std::uint64_t>(tick.count());
    return {count * tick_ns, tick_ns << bits};
  }
};

/// Converts a device's stamps to our timeline. Pure.
///
/// With o(t) the device's clock minus ours, a stamp that arrives says  o(t) >= stamp - arrival:
/// nothing arrives before it happened. The estimate is the line  o(t) = o0 + k t  that lies above
/// all bounds of the last half minute and closest to them. Only the fastest arrivals determine it.
/// The least delay cannot be separated from the offset and remains in the stamps, as in arrivals.
///
/// A clock that jumps, restarts, stops or runs at another rate is rejected. Arrivals replace its
/// stamps until the clock has kept pace with ours for a second.
class DeviceClock {
 public:
  /// Our time of `stamp`, received at `arrival`: never later than `arrival` and never before the
  /// previous result. `arrival` must not decrease; `stamp` decreases only if the clock jumps.
  Timestamp to_local(DeviceTime stamp, Timestamp arrival);

  /// The arrival if there is no stamp.
  Timestamp to_local(std::optional<DeviceTime> stamp, Timestamp arrival) {
    return stamp ? to_local(*stamp, arrival) : arrival;
  }

  /// The stamps that follow are of another clock.
  void change_clock() { segment_.reset(); }

  /// How often a trusted clock was rejected.
  [[nodiscard]] std::uint64_t restarts() const { return restarts_; }

 private:
  /// The estimate since the last rejection; times in seconds since `origin`, offsets relative to
  /// the first.
  struct Segment {
    Timestamp origin{};
    DeviceTime last{};
    Duration elapsed{};  ///< on the device's clock
    BoundEnvelope bounds{+1};
    double center = 0.0;
    double offset = 0.0;  ///< at `center`
    double skew = 0.0;
    double window_end = 0.0;
    std::optional<double> least_delay =
        std::nullopt;  ///< of the window; empty: the next stamp begins it
    int windows_kept = 0;

    [[nodiscard]] double at(double t) const { return offset + skew * (t - center); }
  };

  Timestamp map(DeviceTime stamp, Timestamp arrival);
  void begin(DeviceTime stamp, Timestamp arrival);
  /// Empty: the stamp contradicts the estimate.
  [[nodiscard]] std::optional<double> delay_of(DeviceTime stamp, Timestamp arrival);
  void refit(double now);
  /// False: the clock runs behind ours.
  bool keeps_pace(double now, double delay);
  [[nodiscard]] bool is_trusted() const;

  std::optional<Segment> segment_;
  Timestamp last_local_{Duration::min()};
  std::uint64_t restarts_ = 0;
};

}  // namespace crepes
