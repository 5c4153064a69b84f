/// Stamps of samples that arrive in bundles.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>

#include "estimator/core/measurements.hpp"

namespace crepes {

/// An adapter or a busy machine delivers several samples at once, all stamped with one arrival.
/// Only the newest stamp is right; the earlier samples were measured one period apart. Stamps of a
/// sensor's own clock are not changed.
class BundleSpacing {
 public:
  /// `period` is the sampling period of the device.
  explicit BundleSpacing(Duration period) : period_(period) {}

  /// `bundle` holds the samples of one read, oldest first. Moves all stamps except the newest back:
  /// in order, and after the stamps of the previous bundle. Stamps that differ are kept.
  void apply(std::span<ImuSample> bundle) {
    if (bundle.empty()) return;
    const Timestamp newest = bundle.back().stamp;
    if (bundle.front().stamp != newest) {
      last_ = newest;
      return;
    }
    const auto count = static_cast<std::int64_t>(bundle.size());
    const Duration step = last_ ? std::min(period_, (newest - *last_) / count) : period_;
    Timestamp stamp = newest - (count - 1) * step;
    for (ImuSample& sample : bundle) {
      sample.stamp = stamp;
      stamp += step;
    }
    last_ = newest;
  }

 private:
  Duration period_;
  std::optional<Timestamp> last_;
};

}  // namespace crepes
