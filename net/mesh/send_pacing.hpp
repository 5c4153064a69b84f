/// How much a robot sends, so that the swarm fits the air. Pure functions.
#pragma once

#include <cstddef>
#include <cstdint>

#include "net/mesh/peer_status.hpp"

namespace crepes {

struct SendSettings {
  double rate_hz = 25.0;           ///< datagrams per second
  double air_kbps = 4000.0;        ///< what all robots that hear each other may send together
  double gyro_step_radps = 1e-3;   ///< coarsest rounding of angular rates
  double accel_step_mps2 = 1e-2;   ///< coarsest rounding of specific forces
  std::uint64_t session_salt = 0;  ///< makes the session's number unlike any other; random where
                                   ///< datagrams are sealed

  [[nodiscard]] bool operator==(const SendSettings&) const = default;
};

/// Datagrams that carry each measurement so that one in 500 is lost with all its copies, at least 2
/// and at most 6. `loss` is the share of datagrams that is lost, each by itself.
[[nodiscard]] std::size_t copies_for(double loss);

/// Bytes of a datagram, sealed if it is: the robot's share of the air, and no more than 9.5 kB/s
/// and 0.1 kB/s a neighbor.
[[nodiscard]] std::size_t datagram_bytes(const SendSettings& settings, std::size_t neighbors);

/// Seconds of air that a robot takes per second with broadcasts at `rate_mbps` (IEEE 802.11a/g,
/// 20 MHz): preamble and symbols, mean backoff, and the repeats of batman-adv, which sends each
/// broadcast three times. Headers of UDP, IP, batman-adv, LLC and MAC are added to `bytes`.
[[nodiscard]] double airtime(double datagrams_per_s, double bytes_per_datagram, double rate_mbps);

/// Totals of what was on the air since the start.
struct AirTotals {
  Timestamp at{};
  std::uint64_t sent = 0;
  std::uint64_t sent_bytes = 0;
  std::uint64_t received = 0;
  std::uint64_t received_bytes = 0;
  std::uint64_t lost = 0;  ///< datagrams of peers
};

/// The shares of the channel between two instants. Lost datagrams are as long as those received.
[[nodiscard]] AirShare air_share(const AirTotals& before, const AirTotals& after, double rate_mbps);

}  // namespace crepes
