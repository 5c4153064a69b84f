/// Receives the readings of one neighbor from both sides and queues them for its filter.
#pragma once

#include <optional>
#include <utility>

#include "estimator/swarm/filter_settings.hpp"
#include "estimator/swarm/outcome_log.hpp"
#include "estimator/swarm/range_screen.hpp"
#include "estimator/swarm/reorder_buffer.hpp"

namespace crepes {

/// When each kind of message or reading was last taken; kNever if never.
struct LastContact {
  Timestamp heard = kNever;    ///< a report of the neighbor
  Timestamp seen = kNever;     ///< by our cameras
  Timestamp seen_by = kNever;  ///< by its cameras
  Timestamp ranged = kNever;
};

/// Refuses ranges without line of sight, and readings that the profile does not fuse. All others
/// enter the reorder buffer. Counts the refused ones.
class ReadingIntake {
 public:
  ReadingIntake(RobotId neighbor, const FilterSettings& settings);

  /// Another profile drops the waiting readings.
  void reconfigure(const FilterSettings& settings);

  /// A report of the neighbor arrived.
  void add_report_stamp(Timestamp stamp);
  /// A bearing of our cameras. The distances that come with bearings count while there are no
  /// ranges, five a second: their errors are nearly the same.
  void add_bearing(const Bearing& bearing);
  /// `sigma_rad` replaces that of the bearing.
  void add_peer_bearing(const Bearing& bearing, double sigma_rad);
  /// `kind` is that of our own module or of the neighbor's. False if the range is refused.
  bool add_range(const UwbRange& range, MeasurementKind kind);
  /// Queues a reading that the profile fuses; counts it if it is late.
  void enqueue(Measurement measurement);

  [[nodiscard]] const LastContact& last_contact() const { return last_; }
  /// When the latest range came, if it was refused, too.
  [[nodiscard]] Timestamp newest_range() const { return screen_.latest().value_or(kNever); }
  [[nodiscard]] ReorderBuffer& buffer() { return buffer_; }
  [[nodiscard]] const ReorderBuffer& buffer() const { return buffer_; }
  [[nodiscard]] OutcomeLog& outcomes() { return outcomes_; }
  [[nodiscard]] const OutcomeLog& outcomes() const { return outcomes_; }

  /// The earliest stamp queued since the last call.
  [[nodiscard]] std::optional<Timestamp> take_earliest_new() {
    return std::exchange(earliest_new_, std::nullopt);
  }

 private:
  FilterSettings settings_;
  ReorderBuffer buffer_;
  OutcomeLog outcomes_;
  LastContact last_;
  RangeScreen screen_;
  Timestamp ring_distance_ = kNever;  ///< the latest that was queued
  std::optional<Timestamp> earliest_new_;
};

}  // namespace crepes
