/// Rate limiting: tokens accrue at a steady rate up to a burst and are consumed by work. Pure.
#pragma once

#include <algorithm>
#include <optional>

#include "estimator/core/time.hpp"

namespace crepes {

/// Starts full. Time that goes back adds nothing and removes nothing.
class TokenBucket {
 public:
  /// How many tokens are added a second, and how many fit.
  struct Rate {
    double per_s;
    double burst;
  };

  explicit TokenBucket(Rate rate) : rate_(rate), tokens_(rate.burst) {}

  /// The tokens at `now`.
  double refill(Timestamp now) {
    if (last_ && now > *last_)
      tokens_ = std::min(rate_.burst, tokens_ + rate_.per_s * to_seconds(now - *last_));
    last_ = last_ ? std::max(*last_, now) : now;
    return tokens_;
  }

  /// May leave less than zero: work whose cost is known only afterwards is paid back over time.
  void consume(double tokens) { tokens_ -= tokens; }

  /// Consumes one token, if `reserve` further tokens remain. False: nothing was consumed.
  [[nodiscard]] bool try_consume(Timestamp now, double reserve = 0.0) {
    if (refill(now) < reserve + 1.0) return false;
    consume(1.0);
    return true;
  }

  /// The share of the burst that was left after the last call.
  [[nodiscard]] double fill() const { return tokens_ / rate_.burst; }

 private:
  Rate rate_;
  double tokens_;
  std::optional<Timestamp> last_;
};

}  // namespace crepes
