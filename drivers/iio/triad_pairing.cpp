#include "drivers/iio/triad_pairing.hpp"

namespace crepes {

std::vector<ImuSample> TriadPairing::drain() {
  std::vector<ImuSample> samples;
  while (!rates_.empty()) {
    const StampedTriad rate = rates_.front();
    while (accelerations_.size() >= 2 && accelerations_[1].stamp < rate.stamp)
      accelerations_.pop_front();
    const bool is_too_early = !accelerations_.empty() && rate.stamp < accelerations_.front().stamp;
    const bool must_wait = !is_too_early && accelerations_.size() < 2;
    if (must_wait && rates_.size() <= kMostWaiting) break;
    rates_.pop_front();
    if (is_too_early || must_wait ||
        accelerations_[1].stamp - accelerations_[0].stamp > longest_gap_) {
      if (!is_too_early || has_paired_) ++unpaired_;
      continue;
    }
    has_paired_ = true;
    const StampedTriad& before = accelerations_[0];
    const StampedTriad& after = accelerations_[1];
    const Duration gap = after.stamp - before.stamp;
    const double share =
        gap > Duration::zero() ? to_seconds(rate.stamp - before.stamp) / to_seconds(gap) : 0.0;
    samples.push_back({.stamp = rate.stamp,
                       .gyro_radps = rate.value,
                       .accel_mps2 = before.value + share * (after.value - before.value)});
  }
  while (accelerations_.size() > kMostWaiting) accelerations_.pop_front();
  return samples;
}

}  // namespace crepes
