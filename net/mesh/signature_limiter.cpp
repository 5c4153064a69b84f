#include "net/mesh/signature_limiter.hpp"

#include <algorithm>

namespace crepes {

TokenBucket& SignatureLimiter::bucket_of(const Endpoint& from) {
  const auto found = std::ranges::find(known_, from.address, &Known::address);
  return found != known_.end() ? found->bucket : unknown_;
}

bool SignatureLimiter::allows(const Endpoint& from, Timestamp now) {
  return bucket_of(from).refill(now) >= 1.0;
}

void SignatureLimiter::count_in_vain(const Endpoint& from, Timestamp now) {
  TokenBucket& bucket = bucket_of(from);
  bucket.refill(now);
  bucket.consume(1.0);
}

void SignatureLimiter::count_accepted(const Endpoint& from, Timestamp now) {
  auto found = std::ranges::find(known_, from.address, &Known::address);
  if (found == known_.end()) {
    if (known_.size() == kMaxKnown)
      known_.erase(std::ranges::min_element(known_, {}, &Known::last_accepted));
    found = known_.insert(known_.end(), Known{.address = from.address});
  }
  found->last_accepted = now;
}

}  // namespace crepes
