/// A queue that keeps the newest values and never allocates after construction.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "estimator/core/time.hpp"

namespace crepes {

/// In order of arrival. When full, `add` drops the oldest value.
template <class Reading, std::size_t kCapacity>
class BoundedFifo {
 public:
  BoundedFifo() { readings_.reserve(kCapacity); }

  /// Adds the newest reading.
  void add(const Reading& reading) {
    if (readings_.size() == kCapacity) readings_.erase(readings_.begin());
    readings_.push_back(reading);
  }

  /// Drops values from the front until one is not older than `t`.
  void drop_before(Timestamp t) {
    readings_.erase(readings_.begin(),
                    std::find_if(readings_.begin(), readings_.end(),
                                 [t](const Reading& reading) { return reading.stamp >= t; }));
  }

  /// Drops values wherever they are.
  template <class Predicate>
  void erase_if(Predicate is_unwanted) {
    std::erase_if(readings_, is_unwanted);
  }

  [[nodiscard]] const std::vector<Reading>& all() const { return readings_; }

 private:
  std::vector<Reading> readings_;
};

}  // namespace crepes
