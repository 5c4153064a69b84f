#include "net/request_limiter.hpp"

#include <algorithm>

namespace crepes {
namespace {

constexpr std::size_t kBuckets = 1024;

}  // namespace

bool TokenBucket::take(Timestamp now) {
  const Duration elapsed = std::max(now - last_, Duration::zero());
  tokens_ = std::min(rate_.burst, tokens_ + rate_.per_s * to_seconds(elapsed));
  last_ = now;
  if (tokens_ < 1.0) return false;
  tokens_ -= 1.0;
  return true;
}

RequestLimiter::RequestLimiter(const HashKey& key)
    : key_(key), clients_(kBuckets, TokenBucket(kClientRate)) {}

bool RequestLimiter::admits(const Endpoint& stranger, Timestamp now) {
  const std::size_t bucket = keyed_hash(key_, stranger, 0) % kBuckets;
  return clients_[bucket].take(now) && (stranger.is_loopback() ? local_ : remote_).take(now);
}

}  // namespace crepes
