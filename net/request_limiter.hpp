/// How many requests are read at all: tokens for each client and for all together. Pure.
#pragma once

#include <array>
#include <vector>

#include "estimator/core/time.hpp"
#include "net/endpoint.hpp"
#include "net/keyed_hash.hpp"

namespace crepes {

/// Tokens that come back at a steady rate, up to a burst. Full at first.
class TokenBucket {
 public:
  struct Rate {
    double per_s;
    double burst;
  };

  explicit TokenBucket(Rate rate) : rate_(rate), tokens_(rate.burst) {}

  /// Whether there was a token left, besides those that are to stay.
  [[nodiscard]] bool take(Timestamp now, double reserve = 0.0);
  /// The share of the burst that is left.
  [[nodiscard]] double fill() const { return tokens_ / rate_.burst; }

 private:
  Rate rate_;
  double tokens_;
  Timestamp last_{};
};

/// What one client may ask.
inline constexpr TokenBucket::Rate kClientRate{.per_s = 50, .burst = 100};
/// What all may that have no subscription: on this machine, and elsewhere.
inline constexpr TokenBucket::Rate kStrangersRate{.per_s = 500, .burst = 200};

/// Clients without a subscription share a fixed number of buckets. Each has two, with half of its
/// tokens each, dealt by hashes that it cannot foresee: whoever shares one with a flood is left the
/// other. Machines elsewhere do not use up what programs on this one may ask. Half of what all may
/// is kept for those who ask little.
class RequestLimiter {
 public:
  explicit RequestLimiter(const HashKey& key);

  [[nodiscard]] bool admits(const Endpoint& stranger, Timestamp now);
  /// Whether most of its tokens are left.
  [[nodiscard]] bool asks_little(const Endpoint& stranger) const;

 private:
  [[nodiscard]] std::size_t bucket_of(const Endpoint& stranger, std::size_t half) const;

  HashKey key_;
  std::array<std::vector<TokenBucket>, 2> halves_;
  TokenBucket local_{kStrangersRate};
  TokenBucket remote_{kStrangersRate};
};

}  // namespace crepes
