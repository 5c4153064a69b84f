/// Whether an inertial sensor still measures.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include "estimator/core/measurements.hpp"

namespace crepes {

/// Noise turns some bit of every axis over. Six numbers that stay the same for ten samples are a
/// sensor that hangs; an axis that reads the same for five, beyond what rest or gravity explain, is
/// at the end of its range. (Rounded for a datagram, two in thirty samples may well be the same.)
class ImuWatch {
 public:
  /// False for a sample that says nothing of the motion.
  [[nodiscard]] bool accept(const ImuSample& sample) {
    if (last_ && sample.stamp <= last_->stamp) return true;  // late: not next to the last
    if (last_) compare(*last_, sample);
    last_ = sample;
    is_at_its_end_ = reads_the_end(sample);
    const bool hangs = *std::min_element(repeats_.begin(), repeats_.end()) >= kHanging;
    return !hangs && !is_at_its_end_;
  }

  /// The samples before were as wrong as this one, and passed.
  [[nodiscard]] bool is_at_its_end() const { return is_at_its_end_; }

 private:
  static constexpr int kHanging = 10;
  static constexpr int kAtItsEnd = 4;
  static constexpr double kTurning = 1.0;  // rad/s
  static constexpr double kForced = 15.0;  // m/s^2

  void compare(const ImuSample& before, const ImuSample& sample) {
    const auto count = [&](std::size_t axis, double was, double is) {
      repeats_.at(axis) = was == is ? repeats_.at(axis) + 1 : 0;
    };
    for (int i = 0; i < 3; ++i) {
      count(static_cast<std::size_t>(i), before.gyro_radps(i), sample.gyro_radps(i));
      count(3 + static_cast<std::size_t>(i), before.accel_mps2(i), sample.accel_mps2(i));
    }
  }

  [[nodiscard]] bool reads_the_end(const ImuSample& sample) const {
    for (int i = 0; i < 3; ++i) {
      const auto axis = static_cast<std::size_t>(i);
      if (repeats_.at(axis) >= kAtItsEnd && std::abs(sample.gyro_radps(i)) > kTurning) return true;
      if (repeats_.at(3 + axis) >= kAtItsEnd && std::abs(sample.accel_mps2(i)) > kForced)
        return true;
    }
    return false;
  }

  std::optional<ImuSample> last_;
  bool is_at_its_end_ = false;
  std::array<int, 6> repeats_{};  ///< of each axis, in a row
};

}  // namespace crepes
