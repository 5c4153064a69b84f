/// The broadcast datagram of a robot: versioned, with a checksum, at most 1400 bytes.
///
/// All numbers are little endian. A tick is 10 us of the sender's clock. Measurements carry their
/// stamp as a signed 16-bit number of ticks from the datagram's stamp. Every copy of a measurement
/// decodes to the same stamp.
///   header     "CRP", version u8, sender u16, session u32, sequence u32, sent i64 [ns],
///              report's stamp i32 [ticks from sent]
///   tilt       stamp i32 [ticks], direction, sigma f32
///   echoes     count u8; peer u16, sent i64 [ns, peer's clock], age u32 [us before sent]
///   imu        count u8, exponents i8 i8; stamp, gyro 3 x i16 * 2^e, acceleration 3 x i16 * 2^e;
///              the oldest first
///   cameras    count u8; optical center 3 x f32
///   sources    count u8; neighbor u16, camera u8
///   bearings   count u8; stamp, source u8, direction, sigma u8 (logarithmic)
///   ranges     count u8; neighbor u16, stamp, range f32, powers 2 x u8 [-0.5 dBm]
///   estimates  count u8; neighbor u16, stamp, p 3 x f32, q wxyz 4 x i16, v 3 x f32, sigmas 6 x u16
///              (logarithmic), rows of the correlations' Cholesky factor left of its diagonal 15 x
///              i16
///   crc32      u32 over all preceding bytes
/// A direction is 2 x i16, the octahedral map of a unit vector (error below 5e-5 rad).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <tl/expected.hpp>
#include <vector>

#include "estimator/core/measurements.hpp"

namespace crepes {

inline constexpr std::size_t kMaxPeerMessage = 1400;  ///< bytes of a datagram, sealed or plain

/// "I received at `received` the datagram that you sent at `sent`": half of a clock comparison.
struct ClockEcho {
  RobotId peer{};                ///< whose datagram it was
  std::int64_t sent_ns = 0;      ///< clock of `peer`
  std::int64_t received_ns = 0;  ///< clock of the echo's sender
  bool operator==(const ClockEcho&) const = default;
};

/// A report with the identity of its datagram. `Time` is a time point of the sender's clock.
template <class Time>
struct BasicPeerMessage {
  BasicReport<Time> report;
  Time sent{};                 ///< when the datagram left
  std::uint32_t session = 0;   ///< changes when the sender restarts
  std::uint32_t sequence = 0;  ///< counts the session's datagrams
  std::vector<ClockEcho> echoes;
};

using OutgoingPeerMessage = BasicPeerMessage<Timestamp>;
using PeerMessage = BasicPeerMessage<PeerTimestamp>;

struct EncodedPeerMessage {
  std::vector<std::uint8_t> bytes;
  std::size_t left_out = 0;  ///< measurements without room, or too old for the stamp's range
  std::size_t refused = 0;   ///< measurements that are not finite or cannot be encoded
};

/// Encodes by priority into at most `max_bytes` (900 or more): tilt, echoes, the newest IMU
/// samples, estimates in turn, then bearings and ranges from the newest to the oldest.
[[nodiscard]] EncodedPeerMessage encode_peer_message(const OutgoingPeerMessage& message,
                                                     std::size_t max_bytes = kMaxPeerMessage);

/// Why bytes cannot be decoded.
enum class PeerMessageError : std::uint8_t {
  kTooShort,
  kTooLong,
  kForeign,       ///< not of this protocol
  kOtherVersion,  ///< of this protocol, but another version of it
  kDamaged,       ///< checksum
  kTruncated,     ///< counts exceed the bytes that follow
  kTrailingBytes,
  kNotFinite,
  kBadId,
  kBadStamp,
  kBadIndex,       ///< of a source or camera that the message does not list
  kOutOfRange,     ///< a value that the encoder never writes
  kNotUnit,        ///< direction or quaternion
  kBadCovariance,  ///< not positive definite
};
inline constexpr std::size_t kPeerMessageErrorCount = 14;

/// The message, with finite values only, or the first error.
[[nodiscard]] tl::expected<PeerMessage, PeerMessageError> decode_peer_message(
    std::span<const std::uint8_t> datagram);

}  // namespace crepes
