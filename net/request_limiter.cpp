#include "net/request_limiter.hpp"

#include <algorithm>

namespace crepes {
namespace {

constexpr std::size_t kBuckets = 1024;

}  // namespace

bool TokenBucket::take(Timestamp now, double reserve) {
  const Duration elapsed = std::max(now - last_, Duration::zero());
  tokens_ = std::min(rate_.burst, tokens_ + rate_.per_s * to_seconds(elapsed));
  last_ = now;
  if (tokens_ < reserve + 1.0) return false;
  tokens_ -= 1.0;
  return true;
}

RequestLimiter::RequestLimiter(const HashKey& key)
    : key_(key), clients_(kBuckets, TokenBucket(kClientRate)) {}

bool RequestLimiter::admits(const Endpoint& stranger, Timestamp now) {
  TokenBucket& client = clients_[keyed_hash(key_, stranger, 0) % kBuckets];
  if (!client.take(now)) return false;
  const double reserve = client.fill() < 0.5 ? kStrangersRate.burst / 2 : 0.0;
  return (stranger.is_loopback() ? local_ : remote_).take(now, reserve);
}

}  // namespace crepes
