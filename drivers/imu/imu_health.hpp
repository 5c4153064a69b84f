/// Detects missing samples and a sensor that repeats its values.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

#include "estimator/core/measurements.hpp"

namespace crepes {

/// Receives every sample in order. Stuck samples must be discarded; the rest is diagnosis for
/// users. Pure.
class ImuHealth {
 public:
  /// Totals since the start.
  struct Counts {
    std::uint64_t dropped = 0;  ///< samples that are missing
    std::uint64_t stuck = 0;    ///< samples refused because the values had not changed for too long
  };

  /// `period` is the expected sampling period.
  explicit ImuHealth(Duration period) : period_(period) {}

  /// Whether the sample may be used. Noise always changes some bit of the six numbers; equal
  /// numbers for half a second mean that the sensor hangs.
  [[nodiscard]] bool accept(const ImuSample& sample) {
    const std::optional<ImuSample> before = last_;
    last_ = sample;
    if (!before) {
      unchanged_since_ = sample.stamp;
      return true;
    }
    record_interval(sample.stamp - before->stamp);
    if (sample.gyro_radps != before->gyro_radps || sample.accel_mps2 != before->accel_mps2)
      unchanged_since_ = sample.stamp;
    if (!is_stuck()) return true;
    ++counts_.stuck;
    return false;
  }

  /// One sentence on what is wrong now, if anything.
  [[nodiscard]] std::optional<std::string> diagnosis() const {
    if (last_ && is_stuck()) {
      return "the inertial sensor repeats the same numbers: it hangs; switch it off and on";
    }
    if (gaps_ < kEnoughGaps) return std::nullopt;
    const double periods = mean_gap_s_ / to_seconds(period_);
    if (periods > 1.25) return "fewer samples a second than imu.update_rate; set either";
    if (periods < 0.8) return "more samples a second than imu.update_rate; set either";
    return std::nullopt;
  }

  [[nodiscard]] const Counts& counts() const { return counts_; }

 private:
  [[nodiscard]] bool is_stuck() const {
    constexpr Duration kLongest = std::chrono::milliseconds(500);
    return last_->stamp - unchanged_since_ >= kLongest;
  }

  void record_interval(Duration gap) {
    constexpr double kMemory = 1.0 / kEnoughGaps;
    constexpr double kLongestGap = 10.0;  // periods: longer gaps say nothing about the rate
    const double periods = to_seconds(gap) / to_seconds(period_);
    if (periods > 1.5) counts_.dropped += static_cast<std::uint64_t>(std::lround(periods)) - 1;
    mean_gap_s_ +=
        kMemory * to_seconds(period_) * std::min(periods, kLongestGap) - kMemory * mean_gap_s_;
    ++gaps_;
  }

  static constexpr std::uint64_t kEnoughGaps = 200;

  Duration period_;
  double mean_gap_s_ = to_seconds(period_);
  std::uint64_t gaps_ = 0;
  std::optional<ImuSample> last_;
  Timestamp unchanged_since_{};
  Counts counts_;
};

}  // namespace crepes
