/// A clock that stands still until a test moves it.
#pragma once

#include "estimator/core/clock.hpp"

namespace crepes {

class ManualClock final : public Clock {
 public:
  [[nodiscard]] Timestamp now() const override { return now_; }
  void set(Timestamp t) { now_ = t; }
  void advance(Duration d) { now_ += d; }

 private:
  Timestamp now_{};
};

}  // namespace crepes
