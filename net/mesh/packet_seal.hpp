/// Authenticated encryption of datagrams with the swarm's key. A seal is the encrypted form.
///
/// The first 18 bytes of a datagram (`peer_message.hpp`) remain readable, with "CRS" for "CRP".
/// What follows is encrypted by XChaCha20-Poly1305, with a tag of 16 bytes. The nonce is sender,
/// session and sequence number, filled with zeros: no two datagrams of a swarm share it, because
/// sessions are random. The 18 bytes are authenticated with the rest.
///
/// All robots share one key: a valid seal proves that the sender belongs to the swarm, but not
/// which robot it is: for that there are signatures (`packet_signature.hpp`). Replays are detected
/// by `PeerLink`.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <tl/expected.hpp>
#include <vector>

namespace crepes {

/// The secret that all robots of a swarm share. Every copy is overwritten when it ends.
// NOLINTNEXTLINE(cppcoreguidelines-special-member-functions): a copy needs nothing but its end
struct MeshKey {
  static constexpr std::size_t kSize = 32;

  std::array<std::uint8_t, kSize> bytes{};

  ~MeshKey();
  [[nodiscard]] bool operator==(const MeshKey&) const = default;
};

/// Why a datagram cannot be opened.
enum class UnsealError : std::uint8_t {
  kNotSealed,
  kOtherVersion,
  kNotAuthentic,  ///< sealed with another key, or modified on the way
};

/// A random number for `SendSettings::session_salt`.
[[nodiscard]] std::uint64_t random_salt();

class PacketSeal {
 public:
  static constexpr std::size_t kOverhead = 16;  ///< bytes that sealing adds

  explicit PacketSeal(const MeshKey& key);

  /// False if the system refuses to lock the memory of the key: then it may be swapped.
  [[nodiscard]] bool is_locked() const { return is_locked_; }

  /// Seals a datagram of `encode_peer_message`. Of those with equal first 18 bytes, only one may
  /// ever be sealed: two would reveal each other.
  [[nodiscard]] std::vector<std::uint8_t> seal(std::span<const std::uint8_t> plain) const;
  /// The datagram before it was sealed, or why it cannot be opened.
  [[nodiscard]] tl::expected<std::vector<std::uint8_t>, UnsealError> open(
      std::span<const std::uint8_t> sealed) const;

  /// Whether the datagram has the header of a sealed one.
  [[nodiscard]] static bool is_sealed(std::span<const std::uint8_t> datagram);

 private:
  std::shared_ptr<const MeshKey> key_;  ///< in memory of its own (`locked_key.hpp`)
  bool is_locked_ = false;
};

}  // namespace crepes
