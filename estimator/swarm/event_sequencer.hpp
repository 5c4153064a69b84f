/// Puts measurements of one neighbor in order of their stamps, late ones included.
#pragma once

#include <cstdint>
#include <span>
#include <variant>
#include <vector>

#include "estimator/core/outputs.hpp"
#include "estimator/relative/neighbor_filter.hpp"
#include "estimator/relative/raw_pose.hpp"

namespace crepes {

/// A raw pose and the two bearings that it came from.
struct MutualStart {
  RawPose raw;
  DirectionReading bearing;
  DirectionReading peer_bearing;
};

/// All poses that one robot's bearing allows, for want of the other's; or what the other makes of
/// it.
struct OneWayStart {
  std::vector<GaussianPose> T_B_N;
};

/// One reading that a neighbor's filter can be started or corrected with.
struct Measurement {
  Timestamp stamp{};
  MeasurementKind kind = MeasurementKind::kBearing;
  std::variant<DirectionReading, RangeReading, MutualStart, OneWayStart, GraphPose> reading;
};

/// The leading ones of one kind, instant and camera: candidates, of which at most one is true.
[[nodiscard]] std::span<const Measurement> leading_group(std::span<const Measurement> ordered);

/// Waits `lag` for late data: what has waited so long is released in order, what comes later is
/// refused. Bounded: beyond `kCapacity` the oldest is dropped and counted.
class EventSequencer {
 public:
  static constexpr std::size_t kCapacity = 2048;

  explicit EventSequencer(Duration lag) : lag_(lag) {}

  void set_lag(Duration lag) { lag_ = lag; }

  /// False if the stamp lies before what was released already.
  bool push(Measurement measurement);

  /// The oldest group with a stamp of at most `now - lag`, or nothing. It stays until the next
  /// call.
  [[nodiscard]] std::span<const Measurement> pop_ready(Timestamp now);

  /// What still waits, oldest first.
  [[nodiscard]] const std::vector<Measurement>& pending() const { return pending_; }
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }
  void clear() { pending_.clear(); }

 private:
  Duration lag_;
  Timestamp released_ = Timestamp::min();
  std::vector<Measurement> pending_;
  std::vector<Measurement> ready_;
  std::uint64_t dropped_ = 0;
};

}  // namespace crepes
