#include "net/request_limiter.hpp"

#include <algorithm>

namespace crepes {
namespace {

constexpr std::size_t kBuckets = 1024;
constexpr TokenBucket::Rate kHalfRate{.per_s = kClientRate.per_s / 2,
                                      .burst = kClientRate.burst / 2};

bool is_full_enough(const TokenBucket& bucket) { return bucket.fill() >= 0.5; }

}  // namespace

bool TokenBucket::take(Timestamp now, double reserve) {
  const Duration elapsed = std::max(now - last_, Duration::zero());
  tokens_ = std::min(rate_.burst, tokens_ + rate_.per_s * to_seconds(elapsed));
  last_ = now;
  if (tokens_ < reserve + 1.0) return false;
  tokens_ -= 1.0;
  return true;
}

RequestLimiter::RequestLimiter(const HashKey& key) : key_(key) {
  halves_.fill(std::vector(kBuckets, TokenBucket(kHalfRate)));
}

std::size_t RequestLimiter::bucket_of(const Endpoint& stranger, std::size_t half) const {
  return keyed_hash(key_, stranger, half) % kBuckets;
}

bool RequestLimiter::asks_little(const Endpoint& stranger) const {
  return is_full_enough(halves_[0][bucket_of(stranger, 0)]) ||
         is_full_enough(halves_[1][bucket_of(stranger, 1)]);
}

bool RequestLimiter::admits(const Endpoint& stranger, Timestamp now) {
  for (std::size_t half = 0; half < halves_.size(); ++half) {
    TokenBucket& client = halves_.at(half)[bucket_of(stranger, half)];
    if (!client.take(now)) continue;
    const double reserve = is_full_enough(client) ? 0.0 : kStrangersRate.burst / 2;
    return (stranger.is_loopback() ? local_ : remote_).take(now, reserve);
  }
  return false;
}

}  // namespace crepes
