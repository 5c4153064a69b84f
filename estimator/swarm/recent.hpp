/// The last few readings, in order of arrival.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "estimator/core/time.hpp"

namespace crepes {

/// Takes its memory at once and never more: beyond `kCapacity` the oldest goes.
template <class Reading, std::size_t kCapacity>
class Recent {
 public:
  Recent() { readings_.reserve(kCapacity); }

  void add(const Reading& reading) {
    if (readings_.size() == kCapacity) readings_.erase(readings_.begin());
    readings_.push_back(reading);
  }

  /// Forgets the oldest up to the first that is not before `t`.
  void forget_before(Timestamp t) {
    readings_.erase(readings_.begin(),
                    std::find_if(readings_.begin(), readings_.end(),
                                 [t](const Reading& reading) { return reading.stamp >= t; }));
  }

  [[nodiscard]] const std::vector<Reading>& all() const { return readings_; }

 private:
  std::vector<Reading> readings_;
};

}  // namespace crepes
