/// Limits the signatures that are verified in vain. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "estimator/core/measurements.hpp"
#include "estimator/core/time.hpp"
#include "estimator/core/token_bucket.hpp"
#include "net/endpoint.hpp"

namespace crepes {

/// Verifying a signature takes twenty times as long as opening a seal. Somebody with the swarm's
/// key could therefore overload a robot with false signatures. Only failed verifications consume
/// tokens.
///
/// Address and sender of a datagram can be forged, so a few false datagrams must not exhaust a
/// limit. A source is a sender together with an address from which a datagram of that sender was
/// accepted. All sources share a reserve that is larger than what a channel of 6 Mbit/s carries.
/// When the reserve is exhausted, each source has a bucket of its own, so that false datagrams in
/// one robot's name do not affect the others. All unknown sources share a third bucket.
class SignatureLimiter {
 public:
  static constexpr TokenBucket::Rate kReserveRate{.per_s = 1500, .burst = 300};
  static constexpr TokenBucket::Rate kSourceRate{.per_s = 50, .burst = 100};
  static constexpr TokenBucket::Rate kElsewhereRate{.per_s = 500, .burst = 200};
  /// Addresses of one sender. Beyond that the longest silent one is forgotten, so a member can
  /// displace only its own.
  static constexpr std::size_t kMaxAddresses = 4;

  /// Whether a signature of this source may be verified now.
  [[nodiscard]] bool allows(const Endpoint& from, RobotId sender, Timestamp now);
  /// A signature was false, or its datagram of no use.
  void count_in_vain(const Endpoint& from, RobotId sender, Timestamp now);
  /// A datagram was accepted.
  void count_accepted(const Endpoint& from, RobotId sender, Timestamp now);

 private:
  struct Source {
    RobotId sender{};
    std::array<std::uint8_t, 16> address{};
    TokenBucket bucket{kSourceRate};
    Timestamp last_accepted = kNever;
  };

  [[nodiscard]] std::vector<Source>::iterator find(const Endpoint& from, RobotId sender);
  /// The one that a datagram of this source would take a token from.
  [[nodiscard]] TokenBucket& bucket_of(const Endpoint& from, RobotId sender, Timestamp now);
  void forget_longest_silent(RobotId sender);

  std::vector<Source> sources_;
  TokenBucket reserve_{kReserveRate};
  TokenBucket elsewhere_{kElsewhereRate};
};

}  // namespace crepes
