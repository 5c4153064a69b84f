/// Poses at a rate of one's own. Pure.
#pragma once

#include <map>
#include <optional>

#include "estimator/core/measurements.hpp"

namespace crepes {

/// Thins out the poses of each neighbor to a rate.
class PoseRate {
 public:
  /// `rate_hz` empty: every pose.
  explicit PoseRate(std::optional<double> rate_hz = {}) : rate_hz_(rate_hz) {}

  [[nodiscard]] std::optional<double> rate_hz() const { return rate_hz_; }
  /// Whether a pose at `stamp` is due; stamps of one neighbor must not go back. Counts as sent.
  [[nodiscard]] bool is_due(RobotId neighbor, Timestamp stamp);

 private:
  std::optional<double> rate_hz_;
  std::map<RobotId, Timestamp> next_;
};

}  // namespace crepes
