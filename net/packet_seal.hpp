/// The swarm's seal on its datagrams: whoever has no key can neither read nor make one.
///
///   "CRS", version u8 | nonce 24 bytes | XChaCha20-Poly1305 of the datagram, its tag 16 bytes
///
/// The first four bytes are authenticated with the rest. All robots share one key, so a seal says
/// "a robot of this swarm", not which; that nothing is told twice is the business of whoever opens
/// it (`PeerLink`).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

namespace crepes {

using MeshKey = std::array<std::uint8_t, 32>;

/// Why a datagram cannot be opened.
enum class SealFault : std::uint8_t {
  kNone,     ///< it bears no seal
  kVersion,  ///< of another version
  kBroken,   ///< made with another key, or changed on its way
};
[[nodiscard]] std::string_view name_of(SealFault fault);

class PacketSeal {
 public:
  static constexpr std::size_t kOverhead = 4 + 24 + 16;  ///< bytes that a seal adds

  explicit PacketSeal(const MeshKey& key);

  /// With a nonce of its own, chosen at random: equal datagrams look different.
  [[nodiscard]] std::vector<std::uint8_t> seal(std::span<const std::uint8_t> plain) const;
  [[nodiscard]] tl::expected<std::vector<std::uint8_t>, SealFault> open(
      std::span<const std::uint8_t> sealed) const;

  /// Whether these bytes begin as sealed ones do.
  [[nodiscard]] static bool is_on(std::span<const std::uint8_t> datagram);

 private:
  MeshKey key_;
};

}  // namespace crepes
