/// The tightest bounds on a clock's offset, one for every tenth of a second of a sliding window.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace crepes {

/// "At time t the offset is at least (or at most) `offset`", in seconds.
struct OffsetBound {
  double t = 0.0;
  double offset = 0.0;
};

class BoundEnvelope {
 public:
  static constexpr double kBucket = 0.1;  ///< s
  static constexpr std::int64_t kBuckets = 300;
  static constexpr double kWindow = kBucket * static_cast<double>(kBuckets);  ///< s

  /// `sign` +1 keeps lower bounds (the largest are tight), -1 upper ones.
  explicit BoundEnvelope(int sign) : sign_(sign), slots_(kBuckets) {}

  /// Bounds of one bucket are compared along a line of slope `skew`. False: it is not tighter.
  bool offer(const OffsetBound& bound, double skew) {
    const std::int64_t bucket = bucket_of(bound.t);
    Slot& slot = slots_[static_cast<std::size_t>(((bucket % kBuckets) + kBuckets) % kBuckets)];
    const double gain =
        sign_ * (bound.offset - slot.bound.offset - skew * (bound.t - slot.bound.t));
    if (slot.used && (slot.bucket > bucket || (slot.bucket == bucket && gain <= 0))) return false;
    slot = {true, bucket, bound};
    return true;
  }

  /// All bounds of the window that ends at `now`, in no order.
  [[nodiscard]] std::vector<OffsetBound> bounds(double now) const {
    std::vector<OffsetBound> found;
    found.reserve(slots_.size());
    for (const Slot& slot : slots_)
      if (slot.used && slot.bucket > bucket_of(now) - kBuckets) found.push_back(slot.bound);
    return found;
  }

 private:
  struct Slot {
    bool used = false;
    std::int64_t bucket = 0;
    OffsetBound bound;
  };

  static std::int64_t bucket_of(double t) { return std::llround(std::floor(t / kBucket)); }

  int sign_;
  std::vector<Slot> slots_;
};

/// The tightest bound of the offset at `center`, along lines of slope `skew`; `sign` as above.
[[nodiscard]] inline double tightest(const std::vector<OffsetBound>& bounds, double skew,
                                     double center, int sign) {
  double best = -std::numeric_limits<double>::infinity();
  for (const OffsetBound& b : bounds)
    best = std::max(best, sign * (b.offset - skew * (b.t - center)));
  return sign * best;
}

/// How far the tightest bound errs, one sigma: of n bounds with mean excess mu the smallest has
/// mu/n. While there are few, half the `margin` (to bounds of the other side; 0: there are none)
/// replaces the missing ones.
[[nodiscard]] inline double envelope_sigma(const std::vector<OffsetBound>& bounds, double skew,
                                           double center, double tight, double margin) {
  double excess = std::max(margin, 0.0) / 2;
  for (const OffsetBound& b : bounds)
    excess += std::abs(tight - (b.offset - skew * (b.t - center)));
  const auto n = static_cast<double>(bounds.size());
  return excess / (n * n);
}

/// Where a concave function has its maximum in [low, high].
template <class Function>
[[nodiscard]] double maximizer(double low, double high, Function f) {
  for (int i = 0; i < 32; ++i) {
    const double third = (high - low) / 3;
    if (f(low + third) < f(high - third)) {
      low += third;
    } else {
      high -= third;
    }
  }
  return (low + high) / 2;
}

}  // namespace crepes
