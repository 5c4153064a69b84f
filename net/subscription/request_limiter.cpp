#include "net/subscription/request_limiter.hpp"

namespace crepes {
namespace {

constexpr std::size_t kBuckets = 1024;
constexpr TokenBucket::Rate kHalfRate{.per_s = kClientRate.per_s / 2,
                                      .burst = kClientRate.burst / 2};

bool is_full_enough(const TokenBucket& bucket) { return bucket.fill() >= 0.5; }

}  // namespace

RequestLimiter::RequestLimiter(const HashKey& key) : key_(key) {
  halves_.fill(std::vector(kBuckets, TokenBucket(kHalfRate)));
}

std::size_t RequestLimiter::bucket_of(const Endpoint& client, std::size_t half) const {
  return keyed_hash(key_, client, half) % kBuckets;
}

bool RequestLimiter::is_light_user(const Endpoint& client) const {
  return is_full_enough(halves_[0][bucket_of(client, 0)]) ||
         is_full_enough(halves_[1][bucket_of(client, 1)]);
}

bool RequestLimiter::allows(const Endpoint& client, Timestamp now) {
  for (std::size_t half = 0; half < halves_.size(); ++half) {
    TokenBucket& bucket = halves_.at(half)[bucket_of(client, half)];
    if (!bucket.try_consume(now)) continue;
    const double reserve = is_full_enough(bucket) ? 0.0 : kUnsubscribedRate.burst / 2;
    return (client.is_loopback() ? local_ : remote_).try_consume(now, reserve);
  }
  return false;
}

}  // namespace crepes
