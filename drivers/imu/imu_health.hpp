/// Samples that are missing, and a sensor that repeats itself.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

#include "estimator/core/measurements.hpp"

namespace crepes {

/// Looks at every sample in order; what it says is for people, but for stuck samples, which are
/// to be thrown away. Pure.
class ImuHealth {
 public:
  struct Counts {
    std::uint64_t dropped = 0;  ///< samples whose time passed without them
    std::uint64_t stuck = 0;    ///< samples refused because nothing had changed for too long
  };

  /// `period` is the time from sample to sample that the device should keep.
  explicit ImuHealth(Duration period) : period_(period) {}

  /// Whether the sample may be used. Noise alone turns some bit of six numbers over: the same
  /// numbers for half a second are a sensor that hangs.
  [[nodiscard]] bool accept(const ImuSample& sample) {
    const std::optional<ImuSample> before = last_;
    last_ = sample;
    if (!before) {
      unchanged_since_ = sample.stamp;
      return true;
    }
    note_gap(sample.stamp - before->stamp);
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

  void note_gap(Duration gap) {
    constexpr double kMemory = 1.0 / kEnoughGaps;
    constexpr double kLongestGap = 10.0;  // periods: one that is longer is no matter of rate
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
