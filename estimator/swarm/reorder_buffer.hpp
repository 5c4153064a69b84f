/// Puts the measurements of one neighbor in order of their stamps.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "estimator/swarm/adaptive_lag.hpp"
#include "estimator/swarm/measurement.hpp"

namespace crepes {

/// Holds each measurement until it is as old as the lag, so that later arrivals can be put before
/// it. Then releases in order of the stamps. A measurement older than the last release is refused.
/// The lag follows the delays of the arrivals; `least` bounds it.
/// Bounded: beyond `kCapacity` the oldest is dropped and counted.
class ReorderBuffer {
 public:
  static constexpr std::size_t kCapacity = 2048;

  explicit ReorderBuffer(Duration least) : lag_(least) {}

  /// Sets the lower limit of the lag.
  void set_least_lag(Duration least) { lag_.set_least(least); }
  [[nodiscard]] Duration lag() const { return lag_.value(); }

  /// False if the stamp lies before the last release.
  bool push(Measurement measurement);

  /// The oldest group with a stamp of at most `now - lag()`, or nothing. The span is valid until
  /// the next call.
  [[nodiscard]] std::span<const Measurement> pop_ready(Timestamp now);

  /// The measurements not yet released, oldest first.
  [[nodiscard]] const std::vector<Measurement>& pending() const { return pending_; }
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }
  void clear() { pending_.clear(); }

 private:
  AdaptiveLag lag_;
  Timestamp now_ = Timestamp::min();  ///< of the last release
  Timestamp released_ = Timestamp::min();
  std::vector<Measurement> pending_;
  std::vector<Measurement> ready_;
  std::uint64_t dropped_ = 0;
};

}  // namespace crepes
