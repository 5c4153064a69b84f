/// The time of a simulated world, and the clock of one robot in it.
#pragma once

#include "drivers/sim/sim_config.hpp"
#include "estimator/core/clock.hpp"

namespace crepes {

/// A robot's clock:  local = world (1 + skew) + offset,  with world time counted from the epoch on
/// the machine's clock, which all processes share. Thread-safe.
class SimClock final : public Clock {
 public:
  /// `machine` must outlive this.
  SimClock(const Clock& machine, const SimConfig& config)
      : machine_(machine),
        epoch_(from_seconds(config.epoch_s)),
        offset_s_(config.clock_offset_s),
        rate_(1.0 + config.clock_skew_ppm * 1e-6) {}

  [[nodiscard]] Timestamp now() const override { return local_time(world_s()); }

  /// World time now [s].
  [[nodiscard]] double world_s() const {
    return to_seconds(machine_.now().time_since_epoch() - epoch_);
  }

  /// The time on this robot's clock at a world time.
  [[nodiscard]] Timestamp local_time(double world_s) const {
    return Timestamp{from_seconds(world_s * rate_ + offset_s_)};
  }

  /// The world time at which this robot's clock reads `local` [s].
  [[nodiscard]] double world_time_s(Timestamp local) const {
    return (to_seconds(local.time_since_epoch()) - offset_s_) / rate_;
  }

 private:
  const Clock& machine_;
  Duration epoch_;
  double offset_s_;
  double rate_;
};

}  // namespace crepes
