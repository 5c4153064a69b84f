/// Signatures of datagrams with a robot's own key: Ed25519 (RFC 8032).
///
/// A signed datagram has the bit `kSignedMark` in its version. It ends with the 64 bytes of the
/// signature of all bytes before: version, sender, session, sequence number and contents. A seal
/// is put around it. The swarm's key alone is not sufficient to make one.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace crepes {

/// What the members of a swarm know of a robot's key.
struct PublicKey {
  static constexpr std::size_t kSize = 32;

  std::array<std::uint8_t, kSize> bytes{};

  [[nodiscard]] bool operator==(const PublicKey&) const = default;
};

/// A robot's own key: the seed of RFC 8032, then the public key. Every copy is overwritten when it
/// ends.
// NOLINTNEXTLINE(cppcoreguidelines-special-member-functions): a copy needs nothing but its end
struct RobotKey {
  static constexpr std::size_t kSize = 64;

  std::array<std::uint8_t, kSize> bytes{};

  ~RobotKey();
  [[nodiscard]] bool operator==(const RobotKey&) const = default;
};

/// The key of a seed, which must be secret and random.
[[nodiscard]] RobotKey robot_key_of(std::span<const std::uint8_t, 32> seed);
/// Whether the public part belongs to the seed.
[[nodiscard]] bool is_whole(const RobotKey& key);
/// The public part of a key.
[[nodiscard]] PublicKey public_key_of(const RobotKey& key);

/// Base64, 44 characters.
[[nodiscard]] std::string to_text(const PublicKey& key);
/// Empty for a text that is not a key, and for points that make every signature valid.
[[nodiscard]] std::optional<PublicKey> parse_public_key(std::string_view text);

/// Signs the datagrams of this robot.
class PacketSigner {
 public:
  static constexpr std::size_t kOverhead = 64;  ///< bytes that signing adds

  explicit PacketSigner(const RobotKey& key);

  /// False if the system refuses to lock the memory of the key: then it may be swapped.
  [[nodiscard]] bool is_locked() const { return is_locked_; }

  /// Signs a datagram of `encode_peer_message`. Equal datagrams have equal signatures.
  [[nodiscard]] std::vector<std::uint8_t> sign(std::span<const std::uint8_t> plain) const;

 private:
  std::shared_ptr<const RobotKey> key_;  ///< in memory of its own (`locked_key.hpp`)
  bool is_locked_ = false;
};

/// Whether a datagram that is not sealed has the mark of a signed one, and room for a signature.
[[nodiscard]] bool is_signed(std::span<const std::uint8_t> datagram);
/// Whether this key signed the signed datagram.
[[nodiscard]] bool is_authentic(std::span<const std::uint8_t> datagram, const PublicKey& key);
/// The datagram before it was signed.
[[nodiscard]] std::vector<std::uint8_t> without_signature(std::span<const std::uint8_t> datagram);

}  // namespace crepes
