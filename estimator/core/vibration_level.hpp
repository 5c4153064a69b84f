/// Notices that an airframe begins to vibrate, or ceases to.
#pragma once

#include <algorithm>
#include <cmath>

namespace crepes {

/// The level of the white noise in a signal. A blow hardly counts: one sample raises the level by a
/// fifth at most. So a start of the rotors takes half a second to be known, at 100 samples a
/// second.
class VibrationLevel {
 public:
  /// `noise2` is the noise in the latest samples alone, as a density squared. Returns by how much
  /// the level has changed, zero unless that is clearly more than its own noise. Of a change that
  /// goes on for some time the parts add up to the whole.
  double observe(double noise2) {
    if (count_ < kLearning) {
      ++count_;
      level2_ += (noise2 - level2_) / count_;
      noticed2_ = level2_;
      return 0.0;
    }
    level2_ += kShare * (std::min(noise2, kMost * std::max(level2_, kLeast2)) - level2_);
    const double change2 = std::abs(level2_ - noticed2_);
    if (change2 <= kClear * std::max(level2_, noticed2_)) return 0.0;
    noticed2_ = level2_;
    return change2;
  }

 private:
  static constexpr double kShare = 0.02;  // of one sample: the level's own noise is a seventh
  static constexpr int kLearning = 50;
  static constexpr double kMost = 10.0;    // times the level; white noise exceeds it once in 10^6
  static constexpr double kLeast2 = 1e-6;  // a coarse sensor at rest shows no noise at all
  static constexpr double kClear = 0.5;

  int count_ = 0;
  double level2_ = 0.0;
  double noticed2_ = 0.0;
};

}  // namespace crepes
