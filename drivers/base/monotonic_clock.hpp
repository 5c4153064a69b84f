/// The machine's monotonic clock. Nothing else reads it.
#pragma once

#include <chrono>

#include "estimator/core/clock.hpp"

namespace crepes {

/// CLOCK_MONOTONIC in nanoseconds. Thread-safe.
class MonotonicClock final : public Clock {
 public:
  [[nodiscard]] Timestamp now() const override {
    return Timestamp{
        std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now().time_since_epoch())};
  }
};

}  // namespace crepes
