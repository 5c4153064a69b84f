/// Totals of the traffic on the mesh: datagrams and bytes, refusals by reason.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "net/mesh/packet_seal.hpp"
#include "net/mesh/peer_message.hpp"

namespace crepes {

/// What is counted, in the order of the names.
enum class MeshCounter : std::uint8_t {
  kForwarded,             ///< datagrams of others to robots that do not hear them
  kForwardedBytes,        ///< of those
  kHeldClockUnknown,      ///< reports of a peer whose clock is not known yet
  kLeftOutCopies,         ///< bearings and ranges that were to be repeated and had no room
  kLeftOutOfDatagrams,    ///< neighbors whose newest measurements had no room
  kLeftOutSamples,        ///< inertial samples that were to be repeated and had no room
  kReceived,              ///< datagrams of other robots
  kReceivedAgain,         ///< forwarded ones that we had already
  kReceivedBytes,         ///< of all received
  kRefusedBadCovariance,  ///< this and the following: datagrams, by the reason for the refusal
  kRefusedBadId,
  kRefusedBadIndex,
  kRefusedBadStamp,
  kRefusedClockJump,  ///< its stamps contradict the peer's clock
  kRefusedDamaged,
  kRefusedDoubledId,  ///< of a second robot that uses a peer's id
  kRefusedDuplicate,
  kRefusedEcho,      ///< echoes, not datagrams: of a datagram that we never sent
  kRefusedExcluded,  ///< the configuration excludes the sender
  kRefusedForeign,
  kRefusedNotUnit,
  kRefusedOldSession,  ///< of a session that a newer one has replaced
  kRefusedOtherVersion,
  kRefusedOutOfRange,
  kRefusedOwnId,  ///< another robot uses our id
  kRefusedSealBroken,
  kRefusedSealMissing,
  kRefusedSealUnexpected,  ///< sealed, and we have no key
  kRefusedSealVersion,
  kRefusedSignatureMissing,
  kRefusedSignatureUnchecked,  ///< its address has sent too many in vain
  kRefusedSignatureWrong,
  kRefusedToSend,       ///< measurements of ours that cannot be encoded
  kRefusedTooFarAhead,  ///< its number is further ahead than time has passed
  kRefusedTooLong,
  kRefusedTooOld,
  kRefusedTooShort,
  kRefusedTrailing,
  kRefusedTruncated,
  kRefusedUnknownSender,
  kSent,       ///< datagrams
  kSentBytes,  ///< of those
};
inline constexpr std::size_t kMeshCounterCount = 42;

/// As STATUS and report.json call it.
[[nodiscard]] std::string_view name_of(MeshCounter counter);
/// Whether it counts what was refused.
[[nodiscard]] constexpr bool is_refusal(MeshCounter counter) {
  return counter >= MeshCounter::kRefusedBadCovariance &&
         counter <= MeshCounter::kRefusedUnknownSender;
}
/// The counter of datagrams that are refused for this reason.
[[nodiscard]] MeshCounter counter_of(PeerMessageError error);
/// The counter of datagrams that cannot be opened for this reason.
[[nodiscard]] MeshCounter counter_of(UnsealError error);

class MeshCounters {
 public:
  /// Adds to a total.
  void add(MeshCounter counter, std::uint64_t count = 1) { totals_[index_of(counter)] += count; }

  [[nodiscard]] std::uint64_t operator[](MeshCounter counter) const {
    return totals_[index_of(counter)];
  }
  /// Datagrams that were refused because of their seal or for want of one.
  [[nodiscard]] std::uint64_t seal_refusals() const;
  /// The same because they are of another version of this project.
  [[nodiscard]] std::uint64_t version_refusals() const;
  /// The same for their signature.
  [[nodiscard]] std::uint64_t signature_refusals() const;
  /// By name; counters at zero are left out.
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> totals() const;

 private:
  static constexpr std::size_t index_of(MeshCounter counter) {
    return static_cast<std::size_t>(counter);
  }

  std::array<std::uint64_t, kMeshCounterCount> totals_{};
};

}  // namespace crepes
