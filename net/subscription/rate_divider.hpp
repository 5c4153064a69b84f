/// Reduces a stream of poses to a client's rate. Pure.
#pragma once

#include <map>
#include <optional>

#include "estimator/core/measurements.hpp"

namespace crepes {

/// Decimates the poses of each neighbor to a rate.
class RateDivider {
 public:
  /// An empty `rate_hz` passes every pose.
  explicit RateDivider(std::optional<double> rate_hz = {}) : rate_hz_(rate_hz) {}

  [[nodiscard]] std::optional<double> rate_hz() const { return rate_hz_; }
  /// Whether a pose at `stamp` is due; if so, it counts as sent. Stamps of one neighbor must not
  /// decrease.
  [[nodiscard]] bool is_due(RobotId neighbor, Timestamp stamp);

 private:
  std::optional<double> rate_hz_;
  std::map<RobotId, Timestamp> next_;
};

}  // namespace crepes
