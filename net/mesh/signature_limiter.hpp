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

/// To verify a signature takes twenty times as long as to open a seal, so who has the swarm's key
/// could keep a robot busy with false ones. Only verifications in vain consume tokens.
///
/// Address and sender of a datagram can be forged, so no limit may be so low that a few false ones
/// exhaust it. A source is a sender and an address from which a datagram of it was accepted. All
/// sources share a reserve that is larger than what a channel of 6 Mbit/s carries. When it is
/// exhausted, each has a bucket of its own: false datagrams in the name of one then cost the others
/// nothing. What comes from elsewhere shares a third bucket.
class SignatureLimiter {
 public:
  static constexpr TokenBucket::Rate kReserveRate{.per_s = 1500, .burst = 300};
  static constexpr TokenBucket::Rate kSourceRate{.per_s = 50, .burst = 100};
  static constexpr TokenBucket::Rate kElsewhereRate{.per_s = 500, .burst = 200};
  /// Addresses of a sender; then the longest silent is forgotten. A member can only displace its
  /// own.
  static constexpr std::size_t kMaxAddresses = 4;

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
    Timestamp last_accepted{};
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
