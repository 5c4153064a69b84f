#include "net/mesh/packet_signature.hpp"

#include <sodium.h>

#include <algorithm>
#include <utility>

#include "estimator/core/contract.hpp"
#include "net/mesh/locked_key.hpp"
#include "net/mesh/peer_message.hpp"

namespace crepes {
namespace {

constexpr std::size_t kVersionAt = 3;
constexpr std::size_t kSignature = crypto_sign_BYTES;
constexpr int kBase64 = sodium_base64_VARIANT_ORIGINAL;

static_assert(kSignature == PacketSigner::kOverhead);
static_assert(crypto_sign_PUBLICKEYBYTES == PublicKey::kSize);
static_assert(crypto_sign_SECRETKEYBYTES == RobotKey::kSize);
static_assert(crypto_sign_SEEDBYTES == 32);

}  // namespace

RobotKey::~RobotKey() { sodium_memzero(bytes.data(), bytes.size()); }

RobotKey robot_key_of(std::span<const std::uint8_t, 32> seed) {
  RobotKey key;
  PublicKey known;
  crypto_sign_seed_keypair(known.bytes.data(), key.bytes.data(), seed.data());
  return key;
}

bool is_whole(const RobotKey& key) {
  return robot_key_of(std::span(key.bytes).first<crypto_sign_SEEDBYTES>()) == key;
}

PublicKey public_key_of(const RobotKey& key) {
  PublicKey known;
  std::ranges::copy(std::span(key.bytes).last<PublicKey::kSize>(), known.bytes.begin());
  return known;
}

std::string to_text(const PublicKey& key) {
  std::string text(sodium_base64_ENCODED_LEN(PublicKey::kSize, kBase64), '\0');
  sodium_bin2base64(text.data(), text.size(), key.bytes.data(), key.bytes.size(), kBase64);
  text.pop_back();  // the zero at the end
  return text;
}

std::optional<PublicKey> parse_public_key(std::string_view text) {
  PublicKey key;
  std::size_t size = 0;
  if (sodium_base642bin(key.bytes.data(), key.bytes.size(), text.data(), text.size(), nullptr,
                        &size, nullptr, kBase64) != 0 ||
      size != key.bytes.size() || crypto_core_ed25519_is_valid_point(key.bytes.data()) == 0)
    return std::nullopt;
  return key;
}

PacketSigner::PacketSigner(const RobotKey& key) {
  LockedKey<RobotKey> own = locked(key);
  key_ = std::move(own.key);
  is_locked_ = own.is_locked;
}

std::vector<std::uint8_t> PacketSigner::sign(std::span<const std::uint8_t> plain) const {
  CREPES_EXPECT(plain.size() >= kClearHeader, "a datagram has a header");
  std::vector<std::uint8_t> bytes(plain.begin(), plain.end());
  bytes[kVersionAt] |= kSignedMark;
  bytes.resize(plain.size() + kSignature);
  crypto_sign_detached(bytes.data() + plain.size(), nullptr, bytes.data(), plain.size(),
                       key_->bytes.data());
  return bytes;
}

bool is_signed(std::span<const std::uint8_t> datagram) {
  return datagram.size() >= kClearHeader + kSignature && (datagram[kVersionAt] & kSignedMark) != 0;
}

bool is_authentic(std::span<const std::uint8_t> datagram, const PublicKey& key) {
  if (!is_signed(datagram)) return false;
  const auto contents = datagram.first(datagram.size() - kSignature);
  return crypto_sign_verify_detached(datagram.data() + contents.size(), contents.data(),
                                     contents.size(), key.bytes.data()) == 0;
}

std::vector<std::uint8_t> without_signature(std::span<const std::uint8_t> datagram) {
  CREPES_EXPECT(is_signed(datagram), "a datagram has a signature before it is removed");
  std::vector<std::uint8_t> plain(datagram.begin(), datagram.end() - kSignature);
  plain[kVersionAt] &= static_cast<std::uint8_t>(~kSignedMark);
  return plain;
}

}  // namespace crepes
