/// Refuses ranges that did not come the straight way, and doubts those that may not have.
#pragma once

#include <optional>

#include "estimator/core/measurements.hpp"
#include "estimator/relative/neighbor_filter.hpp"
#include "estimator/swarm/filter_settings.hpp"

namespace crepes {

/// Of the ranges between two robots. Behind an obstacle, ranges are too long even if their first
/// path looks strong: while many of the latest have a weak one, all are refused. An obstacle may
/// hide the antennas and not the LED rings, so sightings do not say otherwise.
///
/// A robot that passes behind an obstacle has ranges that become longer as their first path becomes
/// weaker, for a second perhaps. Before they are refused, they have an error in common, and so they
/// have for a moment after their first path is usual again.
class RangeScreen {
 public:
  /// Empty if the range is refused. Ranges come in the order of their stamps, more or less.
  [[nodiscard]] std::optional<RangeReading> accept(const UwbRange& range,
                                                   const FilterSettings& settings);
  /// Of all that came, refused ones, too.
  [[nodiscard]] std::optional<Timestamp> latest() const { return latest_; }

 private:
  /// By how much first paths usually are weaker than what is received.
  struct UsualGap {
    double mean_db = 0.0;
    double deviation_db = 0.0;  ///< mean absolute
    int count = 0;

    void add(double gap_db);
    /// Gaps above this are unusual.
    [[nodiscard]] double most_db(double late_path_db) const;
  };

  UsualGap usual_;
  double late_share_ = 0.0;  ///< of the latest ranges, those with a weak first path
  double doubt_ = 0.0;       ///< mean of the latest, 1 for one that is almost late
  std::optional<Timestamp> latest_{};
};

}  // namespace crepes
