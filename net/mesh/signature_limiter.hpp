/// Limits the signatures that are verified in vain, by the address that they come from. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "estimator/core/time.hpp"
#include "estimator/core/token_bucket.hpp"
#include "net/endpoint.hpp"

namespace crepes {

/// To verify a signature takes twenty times as long as to open a seal, so who has the swarm's key
/// could keep a robot busy with false ones. An address from which a datagram was accepted has a
/// bucket of its own; all others share one. Only verifications in vain consume tokens.
class SignatureLimiter {
 public:
  static constexpr TokenBucket::Rate kKnownRate{.per_s = 50, .burst = 100};
  static constexpr TokenBucket::Rate kUnknownRate{.per_s = 500, .burst = 200};
  static constexpr std::size_t kMaxKnown = 64;  ///< then the longest silent is forgotten

  [[nodiscard]] bool allows(const Endpoint& from, Timestamp now);
  /// A signature was false, or its datagram of no use.
  void count_in_vain(const Endpoint& from, Timestamp now);
  /// A datagram was accepted.
  void count_accepted(const Endpoint& from, Timestamp now);

 private:
  struct Known {
    std::array<std::uint8_t, 16> address{};
    TokenBucket bucket{kKnownRate};
    Timestamp last_accepted{};
  };

  [[nodiscard]] TokenBucket& bucket_of(const Endpoint& from);

  std::vector<Known> known_;
  TokenBucket unknown_{kUnknownRate};
};

}  // namespace crepes
