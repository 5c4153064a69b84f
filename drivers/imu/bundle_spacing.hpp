/// Samples that reach us several at a time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>

#include "estimator/core/measurements.hpp"

namespace crepes {

/// An adapter or a busy machine hands over samples in bundles, all stamped with one arrival. That
/// is right for the newest only; those before it were measured a period apart. Stamps of a sensor's
/// own clock stay as they are.
class BundleSpacing {
 public:
  /// `period` is the time from sample to sample of the device.
  explicit BundleSpacing(Duration period) : period_(period) {}

  /// Moves all stamps of `bundle`, read at once and oldest first, but the newest back: in order,
  /// and after what the bundle before it was stamped with. Where they differ, each is its own.
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
