/// How much a robot sends, so that the swarm fits the air. Pure functions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>

#include "net/mesh/peer_message.hpp"
#include "net/mesh/peer_status.hpp"

namespace crepes {

/// How a datagram travels.
struct Broadcasts {
  double rate_mbps = 6.0;  ///< the lowest basic rate of the Wi-Fi
  int repeats = 3;         ///< how often it is on the air; batman-adv sends each broadcast 3 times

  [[nodiscard]] bool operator==(const Broadcasts&) const = default;
};

/// What and how often a robot sends.
struct SendSettings {
  double rate_hz = 25.0;           ///< reports per second, and datagrams at most
  double airtime_of_all = 0.5;     ///< share of the channel for all robots that hear each other
  Broadcasts broadcasts{};         ///< what a datagram takes of it
  double gyro_step_radps = 1e-3;   ///< coarsest rounding of angular rates
  double accel_step_mps2 = 1e-2;   ///< coarsest rounding of specific forces
  std::uint64_t session_salt = 0;  ///< makes the session's number unlike any other; random where
                                   ///< datagrams are sealed

  [[nodiscard]] bool operator==(const SendSettings&) const = default;
};

/// Datagrams that carry a measurement, at most.
inline constexpr std::size_t kMostCopies = 6;

/// Datagrams that carry each measurement so that one in 500 is lost with all its copies, at least 2
/// and at most 6. `loss` is the share of datagrams that is lost, each by itself.
[[nodiscard]] std::size_t copies_for(double loss);

/// When a robot sends, and how much.
struct Pace {
  std::size_t reports = 1;              ///< a datagram is sent for each of so many
  std::size_t bytes = kMaxPeerMessage;  ///< of a datagram, sealed if it is
};

/// A robot may use an equal part of the air, and at most 9.5 kB/s plus 0.1 kB/s a neighbor. If one
/// datagram for each report would be too short, it sends fewer and longer ones, because most of a
/// short one's airtime is headers and waiting. It sends at least four a second, because others
/// extrapolate its motion between them. No datagram is made shorter than kMinPeerMessage.
/// Forwarding
/// (`forwarded_air`) is subtracted from its part.
[[nodiscard]] Pace pace_of(const SendSettings& settings, std::size_t neighbors,
                           double forwarded_air = 0.0);

/// The share of the channel's time that a robot may take to forward: three quarters of its part.
[[nodiscard]] double forwarding_part(const SendSettings& settings, std::size_t neighbors);

/// Seconds of air that a robot takes per second with broadcasts (IEEE 802.11a/g, 20 MHz): preamble
/// and symbols, mean backoff, and all repeats. Headers of UDP, IP, batman-adv, LLC and MAC are
/// added to `bytes`.
[[nodiscard]] double airtime(double datagrams_per_s, double bytes_per_datagram,
                             const Broadcasts& broadcasts);

/// Totals of what was on the air since the start.
struct AirTotals {
  Timestamp at{};
  std::uint64_t sent = 0;
  std::uint64_t sent_bytes = 0;
  std::uint64_t received = 0;
  std::uint64_t received_bytes = 0;
  std::uint64_t lost = 0;                     ///< datagrams of peers
  std::map<RobotId, std::uint64_t> of_peers;  ///< datagrams of each, with those that were lost
};

/// The shares of the channel between two instants. Every datagram of a peer, received or lost,
/// counts with the mean length of those received.
[[nodiscard]] AirShare air_share(const AirTotals& before, const AirTotals& after,
                                 const Broadcasts& broadcasts);

}  // namespace crepes
