#include "net/mesh/signature_limiter.hpp"

#include <algorithm>

namespace crepes {

std::vector<SignatureLimiter::Source>::iterator SignatureLimiter::find(const Endpoint& from,
                                                                       RobotId sender) {
  return std::ranges::find_if(sources_, [&](const Source& source) {
    return source.sender == sender && source.address == from.address;
  });
}

TokenBucket& SignatureLimiter::bucket_of(const Endpoint& from, RobotId sender, Timestamp now) {
  const auto source = find(from, sender);
  if (source == sources_.end()) return elsewhere_;
  return reserve_.refill(now) >= 1.0 ? reserve_ : source->bucket;
}

bool SignatureLimiter::allows(const Endpoint& from, RobotId sender, Timestamp now) {
  return bucket_of(from, sender, now).refill(now) >= 1.0;
}

void SignatureLimiter::count_in_vain(const Endpoint& from, RobotId sender, Timestamp now) {
  TokenBucket& bucket = bucket_of(from, sender, now);
  bucket.refill(now);
  bucket.consume(1.0);
}

void SignatureLimiter::count_accepted(const Endpoint& from, RobotId sender, Timestamp now) {
  auto source = find(from, sender);
  if (source == sources_.end()) {
    forget_longest_silent(sender);
    source = sources_.insert(sources_.end(), Source{.sender = sender, .address = from.address});
  }
  source->last_accepted = now;
}

/// Makes room for an address of the sender.
void SignatureLimiter::forget_longest_silent(RobotId sender) {
  auto oldest = sources_.end();
  std::size_t addresses = 0;
  for (auto source = sources_.begin(); source != sources_.end(); ++source) {
    if (source->sender != sender) continue;
    ++addresses;
    if (oldest == sources_.end() || source->last_accepted < oldest->last_accepted) oldest = source;
  }
  if (addresses >= kMaxAddresses) sources_.erase(oldest);
}

}  // namespace crepes
