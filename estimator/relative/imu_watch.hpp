/// Detects an IMU that repeats its values or is saturated.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <optional>

#include "estimator/core/measurements.hpp"

namespace crepes {

/// Noise changes every axis from sample to sample. If all six values repeat for ten samples and 50
/// ms, the sensor hangs; for less, it is read more often than it measures. If one large value
/// repeats for five samples, while others change, the axis is saturated. (After rounding for a
/// datagram, two of thirty samples may be equal by chance.) One axis hangs if it repeats far more
/// often in a row than it used to, while the other two of its sensor never repeat: a coarse sensor
/// at rest repeats on all.
class ImuWatch {
 public:
  /// False for a sample that does not measure the motion.
  [[nodiscard]] bool accept(const ImuSample& sample) {
    if (last_ && sample.stamp <= last_->stamp) return true;  // late: not next to the last
    const bool is_held =
        last_ && sample.gyro_radps == last_->gyro_radps && sample.accel_mps2 == last_->accel_mps2;
    if (last_ && !is_held) compare(*last_, sample);
    held_ = is_held ? held_ + 1 : 0;
    if (!is_held) changed_ = sample.stamp;
    last_ = sample;
    is_saturated_ = reads_range_limit(sample);
    const bool hangs = held_ >= kHanging && sample.stamp - changed_ >= kLongestPeriod;
    return !hangs && !is_saturated_ && !an_axis_hangs();
  }

  /// True if the last sample was saturated. The ones before it were as wrong, and accepted.
  [[nodiscard]] bool is_saturated() const { return is_saturated_; }

 private:
  static constexpr int kHanging = 10;
  static constexpr Duration kLongestPeriod = std::chrono::milliseconds{50};  // of a sensor
  static constexpr int kSaturated = 4;
  static constexpr double kByChance = 1e-9;  // of a run of repeats
  static constexpr double kMemory = 500.0;   // samples in the share of repeats
  static constexpr double kTurning = 1.0;    // rad/s
  static constexpr double kForced = 15.0;    // m/s^2

  void compare(const ImuSample& before, const ImuSample& sample) {
    const auto count = [&](std::size_t axis, double was, double is) {
      const bool repeats = was == is;
      repeats_.at(axis) = repeats ? repeats_.at(axis) + 1 : 0;
      changes_.at(axis) = repeats ? 0 : changes_.at(axis) + 1;
      share_.at(axis) += ((repeats ? 1.0 : 0.0) - share_.at(axis)) / kMemory;
    };
    for (int i = 0; i < 3; ++i) {
      count(static_cast<std::size_t>(i), before.gyro_radps(i), sample.gyro_radps(i));
      count(3 + static_cast<std::size_t>(i), before.accel_mps2(i), sample.accel_mps2(i));
    }
  }

  [[nodiscard]] bool an_axis_hangs() const {
    for (std::size_t axis = 0; axis < repeats_.size(); ++axis) {
      const int run = repeats_.at(axis);
      if (run < kHanging) continue;
      const std::size_t sensor = axis / 3 * 3;
      const int others =
          std::min(changes_.at(sensor + (axis + 1) % 3), changes_.at(sensor + (axis + 2) % 3));
      if (others >= run && std::pow(std::max(share_.at(axis), 1.0 / kMemory), run) < kByChance)
        return true;
    }
    return false;
  }

  [[nodiscard]] bool reads_range_limit(const ImuSample& sample) const {
    for (int i = 0; i < 3; ++i) {
      const auto axis = static_cast<std::size_t>(i);
      if (repeats_.at(axis) >= kSaturated && std::abs(sample.gyro_radps(i)) > kTurning) return true;
      if (repeats_.at(3 + axis) >= kSaturated && std::abs(sample.accel_mps2(i)) > kForced)
        return true;
    }
    return false;
  }

  std::optional<ImuSample> last_;
  Timestamp changed_ = kNever;  ///< the last sample that differed from the one before
  int held_ = 0;                ///< samples since then
  bool is_saturated_ = false;
  std::array<int, 6> repeats_{};   ///< of each axis, in a row, of samples that differ
  std::array<int, 6> changes_{};   ///< the same
  std::array<double, 6> share_{};  ///< of repeats among the latest samples
};

}  // namespace crepes
