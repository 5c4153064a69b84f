/// Limits the requests that are parsed, for each client and for all together. Pure.
#pragma once

#include <array>
#include <vector>

#include "estimator/core/time.hpp"
#include "estimator/core/token_bucket.hpp"
#include "net/endpoint.hpp"
#include "net/subscription/keyed_hash.hpp"

namespace crepes {

/// Requests of one client.
inline constexpr TokenBucket::Rate kClientRate{.per_s = 50, .burst = 100};
/// Requests of all clients without a subscription: one limit for this machine, one for others.
inline constexpr TokenBucket::Rate kUnsubscribedRate{.per_s = 500, .burst = 200};

/// Clients without a subscription share a fixed number of buckets. Each client has two, with half
/// of its tokens in each, selected by hashes that it cannot predict. A client that shares one
/// bucket with a flood can still use the other. Remote clients do not consume the tokens of local
/// ones. Half of the common tokens are reserved for clients with few requests.
class RequestLimiter {
 public:
  explicit RequestLimiter(const HashKey& key);

  [[nodiscard]] bool allows(const Endpoint& client, Timestamp now);
  /// Whether at least half of the client's tokens are left.
  [[nodiscard]] bool is_light_user(const Endpoint& client) const;

 private:
  [[nodiscard]] std::size_t bucket_of(const Endpoint& client, std::size_t half) const;

  HashKey key_;
  std::array<std::vector<TokenBucket>, 2> halves_;
  TokenBucket local_{kUnsubscribedRate};
  TokenBucket remote_{kUnsubscribedRate};
};

}  // namespace crepes
