/// Refuses ranges that did not come the straight way.
#pragma once

#include <optional>

#include "estimator/core/measurements.hpp"
#include "estimator/swarm/filter_settings.hpp"

namespace crepes {

/// Of the ranges between two robots. Behind an obstacle, ranges are too long even if their first
/// path looks strong: while many of the latest have a weak one, all are refused. An obstacle may
/// hide the antennas and not the LED rings, so sightings do not say otherwise.
class RangeScreen {
 public:
  /// Ranges come in the order of their stamps, more or less.
  [[nodiscard]] bool accepts(const UwbRange& range, const FilterSettings& settings);
  /// Of all that came, refused ones, too.
  [[nodiscard]] std::optional<Timestamp> latest() const { return latest_; }

 private:
  double late_share_ = 0.0;  ///< of the latest ranges, those with a weak first path
  std::optional<Timestamp> latest_{};
};

}  // namespace crepes
