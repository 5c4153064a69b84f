#include "net/mesh/packet_seal.hpp"

#include <sodium.h>

#include <algorithm>
#include <utility>

#include "estimator/core/contract.hpp"
#include "net/mesh/locked_key.hpp"
#include "net/mesh/peer_message.hpp"

namespace crepes {
namespace {

constexpr std::array<std::uint8_t, 4> kMark{'C', 'R', 'S', 2};  // the last byte is the version
constexpr std::size_t kLetter = 2;                              // 'P' in a plain datagram
constexpr std::size_t kMagic = 3;
constexpr std::size_t kNonce = crypto_aead_xchacha20poly1305_ietf_NPUBBYTES;
constexpr std::size_t kTag = crypto_aead_xchacha20poly1305_ietf_ABYTES;

static_assert(kTag == PacketSeal::kOverhead);
static_assert(kClearHeader - kMark.size() <= kNonce);
static_assert(crypto_aead_xchacha20poly1305_ietf_KEYBYTES == MeshKey::kSize);

/// Sender, session and sequence number.
std::array<std::uint8_t, kNonce> nonce_of(std::span<const std::uint8_t> header) {
  std::array<std::uint8_t, kNonce> nonce{};
  std::ranges::copy(header.subspan(kMark.size()), nonce.begin());
  return nonce;
}

}  // namespace

MeshKey::~MeshKey() { sodium_memzero(bytes.data(), bytes.size()); }

std::uint64_t random_salt() {
  CREPES_EXPECT(sodium_init() >= 0, "the system has random numbers");
  std::uint64_t salt = 0;
  randombytes_buf(&salt, sizeof salt);
  return salt;
}

PacketSeal::PacketSeal(const MeshKey& key) {
  LockedKey<MeshKey> own = locked(key);
  key_ = std::move(own.key);
  is_locked_ = own.is_locked;
}

std::vector<std::uint8_t> PacketSeal::seal(std::span<const std::uint8_t> plain) const {
  CREPES_EXPECT(plain.size() >= kClearHeader, "a datagram has a header");
  std::vector<std::uint8_t> sealed(plain.begin(), plain.begin() + kClearHeader);
  sealed[kLetter] = kMark[kLetter];
  sealed.resize(plain.size() + kOverhead);
  const std::span header = std::span(sealed).first(kClearHeader);
  const auto nonce = nonce_of(header);
  const auto body = plain.subspan(kClearHeader);
  crypto_aead_xchacha20poly1305_ietf_encrypt(sealed.data() + kClearHeader, nullptr, body.data(),
                                             body.size(), header.data(), header.size(), nullptr,
                                             nonce.data(), key_->bytes.data());
  return sealed;
}

tl::expected<std::vector<std::uint8_t>, UnsealError> PacketSeal::open(
    std::span<const std::uint8_t> sealed) const {
  if (!is_sealed(sealed)) return tl::unexpected(UnsealError::kNotSealed);
  if ((sealed[kMagic] & ~kSignedMark) != kMark[kMagic])
    return tl::unexpected(UnsealError::kOtherVersion);
  if (sealed.size() < kClearHeader + kTag) return tl::unexpected(UnsealError::kNotAuthentic);
  const auto header = sealed.first(kClearHeader);
  const auto secret = sealed.subspan(kClearHeader);
  const auto nonce = nonce_of(header);
  std::vector<std::uint8_t> plain(header.begin(), header.end());
  plain[kLetter] = 'P';
  plain.resize(sealed.size() - kTag);
  const int verdict = crypto_aead_xchacha20poly1305_ietf_decrypt(
      plain.data() + kClearHeader, nullptr, nullptr, secret.data(), secret.size(), header.data(),
      header.size(), nonce.data(), key_->bytes.data());
  if (verdict != 0) return tl::unexpected(UnsealError::kNotAuthentic);
  return plain;
}

bool PacketSeal::is_sealed(std::span<const std::uint8_t> datagram) {
  return datagram.size() >= kMark.size() &&
         std::equal(kMark.begin(), kMark.begin() + kMagic, datagram.begin());
}

}  // namespace crepes
