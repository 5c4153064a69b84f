/// How long to wait for readings that arrive late.
#pragma once

#include <algorithm>

#include "estimator/core/time.hpp"

namespace crepes {

/// A quantile of the delays with which readings arrive, tracked by stochastic approximation
/// (Robbins and Monro 1951): one in a hundred arrives later than the lag. Like the jitter buffer of
/// a telephone, it follows the network, between `least` and 500 ms.
class AdaptiveLag {
 public:
  explicit AdaptiveLag(Duration least) : least_(least), lag_(least) {}

  /// Sets the lower limit.
  void set_least(Duration least) {
    least_ = least;
    lag_ = std::clamp(lag_, least_, most());
  }
  /// `delay` is the time from the measurement to its arrival.
  void add(Duration delay) {
    const Duration step = delay > lag_ ? kLateStep : -kTimelyStep;
    lag_ = std::clamp(lag_ + step, least_, most());
  }
  [[nodiscard]] Duration value() const { return lag_; }

 private:
  static constexpr Duration kTimelyStep = std::chrono::microseconds{20};
  static constexpr Duration kLateStep = 99 * kTimelyStep;

  [[nodiscard]] Duration most() const {
    return std::max<Duration>(least_, std::chrono::milliseconds{500});
  }

  Duration least_;
  Duration lag_;
};

}  // namespace crepes
