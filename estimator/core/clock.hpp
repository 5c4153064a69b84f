/// The interface that reads a clock. For drivers, net and daemon; the rest of estimator/ may
/// not include it.
#pragma once

#include "estimator/core/time.hpp"

namespace crepes {

class Clock {
 public:
  Clock() = default;
  Clock(const Clock&) = delete;
  Clock& operator=(const Clock&) = delete;
  Clock(Clock&&) = delete;
  Clock& operator=(Clock&&) = delete;
  virtual ~Clock() = default;

  /// Thread-safe; never goes back.
  [[nodiscard]] virtual Timestamp now() const = 0;
};

}  // namespace crepes
