/// Where a device's clock stands against ours, out of when its stamps arrive.
#pragma once

#include <cstdint>
#include <optional>

#include "estimator/core/bound_envelope.hpp"
#include "estimator/core/time.hpp"

namespace crepes {

/// What a device's counter says.
struct DeviceTime {
  std::uint64_t ns = 0;
  std::uint64_t wrap_ns = 0;  ///< the counter begins anew here; 0: where 64 bits end

  /// A counter of so many bits, less than 64.
  [[nodiscard]] static constexpr DeviceTime ticks(std::uint64_t count, Duration tick,
                                                  unsigned bits) {
    const auto tick_ns = static_cast<std::uint64_t>(tick.count());
    return {count * tick_ns, tick_ns << bits};
  }
};

/// Brings a device's stamps to our timeline. Pure.
///
/// With o(t) the device's clock minus ours, a stamp that arrives says  o(t) >= stamp - arrival:
/// nothing arrives before it happened. Of the lines  o(t) = o0 + k t  above all these bounds of the
/// last half minute, the one closest to them is the estimate: the fastest arrivals alone carry it.
/// What even the fastest needed cannot be told from the offset; it stays in the stamps, as it does
/// in arrivals.
///
/// A clock that jumps, restarts, stands still or runs at another rate is dropped; the arrival
/// stands in for the stamp until the clock has kept pace with ours for a second.
class DeviceClock {
 public:
  /// Our time of `stamp`, which reached us at `arrival`: never later than that, and never before
  /// what the stamp before gave. Neither argument goes back but for a device's clock that jumps.
  Timestamp to_local(DeviceTime stamp, Timestamp arrival);

  /// The arrival, where there is no stamp.
  Timestamp to_local(std::optional<DeviceTime> stamp, Timestamp arrival) {
    return stamp ? to_local(*stamp, arrival) : arrival;
  }

  /// How often a clock that was relied on had to be dropped.
  [[nodiscard]] std::uint64_t restarts() const { return restarts_; }

 private:
  /// Of one clock without a break; times in seconds since `origin`, offsets since the first.
  struct Course {
    Timestamp origin{};
    DeviceTime last{};
    Duration elapsed{};  ///< of the device
    BoundEnvelope bounds{+1};
    double center = 0.0;
    double offset = 0.0;  ///< at `center`
    double skew = 0.0;
    double look_end = 0.0;
    std::optional<double> least_delay =
        std::nullopt;  ///< of the look; empty: the next stamp begins it
    int good_looks = 0;

    [[nodiscard]] double at(double t) const { return offset + skew * (t - center); }
  };

  Timestamp map(DeviceTime stamp, Timestamp arrival);
  void begin(DeviceTime stamp, Timestamp arrival);
  /// Empty: this is not the clock that it was.
  [[nodiscard]] std::optional<double> delay_of(DeviceTime stamp, Timestamp arrival);
  void refit(double now);
  /// False: the clock does not keep pace.
  bool look(double now, double delay);
  [[nodiscard]] bool is_relied_on() const;

  std::optional<Course> course_;
  Timestamp last_local_{Duration::min()};
  std::uint64_t restarts_ = 0;
};

}  // namespace crepes
