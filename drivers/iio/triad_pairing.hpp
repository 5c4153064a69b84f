/// Samples from a gyroscope and an accelerometer that measure at different times.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "estimator/core/measurements.hpp"

namespace crepes {

/// A rate or an acceleration, and its time.
struct StampedTriad {
  Timestamp stamp;
  Eigen::Vector3d value;
};

/// Interpolates the acceleration at the times of the rates. Stamps of each must not decrease. Pure.
class TriadPairing {
 public:
  /// Does not interpolate over more than `longest_gap` between two accelerations.
  explicit TriadPairing(Duration longest_gap) : longest_gap_(longest_gap) {}

  void add_rate(const StampedTriad& rate) { rates_.push_back(rate); }
  void add_acceleration(const StampedTriad& acceleration) {
    accelerations_.push_back(acceleration);
  }

  /// The samples that are complete, in order. A rate waits for the next acceleration.
  [[nodiscard]] std::vector<ImuSample> drain();

  /// Rates without acceleration, but for those before the first.
  [[nodiscard]] std::uint64_t unpaired() const { return unpaired_; }

 private:
  static constexpr std::size_t kMostWaiting = 256;

  Duration longest_gap_;
  std::deque<StampedTriad> rates_;
  std::deque<StampedTriad> accelerations_;
  std::uint64_t unpaired_ = 0;
  bool has_paired_ = false;
};

}  // namespace crepes
