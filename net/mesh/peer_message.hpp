/// The broadcast datagram of a robot, version 2: at most 1400 bytes, a few hundred as a rule.
///
/// It begins with 18 bytes in the clear, little endian:
///   "CRP", version u8, sender u16, session u64, sequence u32
/// Then follow bits (`peer_message_code.hpp`) and, last, the CRC-32 of all bytes before. A
/// signature
/// (`packet_signature.hpp`) and a seal (`packet_seal.hpp`) may be put around that.
///
/// A tick is 10 us of the sender's clock. Measurements carry their age in ticks before the
/// datagram's own, so every copy of a measurement decodes to the same stamp. Directions are rounded
/// by at most 1e-4 rad, ranges to a millimetre, inertial samples to a fraction of their noise.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <tl/expected.hpp>
#include <vector>

#include "estimator/core/measurements.hpp"

namespace crepes {

inline constexpr std::size_t kMaxPeerMessage = 1400;  ///< bytes of a datagram, sealed or plain
inline constexpr std::size_t kMinPeerMessage = 320;   ///< the least that a sender may be limited to
inline constexpr std::size_t kClearHeader = 18;       ///< bytes that a seal does not hide
inline constexpr std::uint8_t kSignedMark = 0x80;     ///< bit of the version: a signature follows

/// "I received at `received` the datagram that you sent": half of a clock comparison.
struct ClockEcho {
  RobotId peer{};                ///< whose datagram it was
  std::uint32_t sent_code = 0;   ///< `echo_code` of the datagram
  std::int64_t received_ns = 0;  ///< clock of the echo's sender
  double loss = 0.0;             ///< recent share of the peer's datagrams that did not arrive
  bool is_direct = true;         ///< not only what others forward arrives
  bool operator==(const ClockEcho&) const = default;
};

/// Represents the time of sending in an echo. It differs between the datagrams of the last seconds,
/// and only a receiver of the datagram can know it.
[[nodiscard]] constexpr std::uint32_t echo_code(std::int64_t sent_ns) {
  return static_cast<std::uint32_t>(sent_ns);
}

/// A report with the identity of its datagram. `Time` is a time point of the sender's clock.
template <class Time>
struct BasicPeerMessage {
  BasicReport<Time> report;
  Time sent{};                 ///< when the datagram left
  std::uint64_t session = 0;   ///< changes when the sender restarts
  std::uint32_t sequence = 0;  ///< counts the session's datagrams
  std::uint32_t mark = 0;      ///< to be forwarded, as one in `mark` of the session; 0: it is not
  std::vector<ClockEcho> echoes;
};

using OutgoingPeerMessage = BasicPeerMessage<Timestamp>;
using PeerMessage = BasicPeerMessage<PeerTimestamp>;

/// How much of a report travels.
struct WireLimits {
  std::size_t bytes = kMaxPeerMessage;  ///< of the datagram, at least kMinPeerMessage
  std::size_t copies = 6;               ///< datagrams that carry a measurement
  Duration period{40'000'000};          ///< between datagrams
  std::size_t reports = 1;              ///< that a datagram stands for
  double gyro_step_radps = 1e-3;        ///< coarsest rounding of angular rates
  double accel_step_mps2 = 1e-2;        ///< coarsest rounding of specific forces
  /// Inertial samples until then have all their copies. Later ones are sent however old they are:
  /// an IMU's samples may be believed only when others confirm them.
  Timestamp samples_sent = Timestamp::max();
};

/// A datagram, and the number of measurements that had no room.
struct EncodedPeerMessage {
  std::vector<std::uint8_t> bytes;
  std::size_t left_out = 0;          ///< neighbors whose newest measurements had no room
  std::size_t left_out_copies = 0;   ///< bearings and ranges without room, of the other neighbors
  std::size_t left_out_samples = 0;  ///< inertial samples without room
  std::size_t refused = 0;           ///< measurements that are not finite or cannot be encoded
};

/// Encodes what fits. If space is short, it omits in this order: bearings and ranges beyond one for
/// each neighbor, evenly, in a datagram that stands for several reports; older copies of bearings
/// and ranges; older copies of inertial samples; whole neighbors, by turns, and most estimates.
/// Each datagram contains the next estimate and the next three echoes, or up to eight echoes where
/// datagrams are fewer.
[[nodiscard]] EncodedPeerMessage encode_peer_message(const OutgoingPeerMessage& message,
                                                     const WireLimits& limits = {});

/// What a datagram's first bytes say of it.
struct PeerHeader {
  RobotId sender{};
  std::uint64_t session = 0;
  std::uint32_t sequence = 0;
};

/// Why bytes cannot be decoded.
enum class PeerMessageError : std::uint8_t {
  kTooShort,
  kTooLong,
  kForeign,       ///< not of this protocol
  kOtherVersion,  ///< of this protocol, but another version of it
  kDamaged,       ///< checksum
  kTruncated,     ///< counts exceed the bytes that follow
  kTrailingBytes,
  kBadId,
  kBadStamp,
  kBadIndex,       ///< of a camera that the message does not list
  kOutOfRange,     ///< a value that the encoder never writes
  kNotUnit,        ///< direction or quaternion
  kBadCovariance,  ///< not positive definite
};
inline constexpr std::size_t kPeerMessageErrorCount = 13;

/// Of a datagram that is not sealed, signed or not.
[[nodiscard]] tl::expected<PeerHeader, PeerMessageError> decode_peer_header(
    std::span<const std::uint8_t> datagram);

/// The message, with finite values only, or the first error. The datagram has neither seal nor
/// signature.
[[nodiscard]] tl::expected<PeerMessage, PeerMessageError> decode_peer_message(
    std::span<const std::uint8_t> datagram);

}  // namespace crepes
