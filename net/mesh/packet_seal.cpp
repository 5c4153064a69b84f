#include "net/mesh/packet_seal.hpp"

#include <sodium.h>

#include <algorithm>
#include <new>

#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

constexpr std::array<std::uint8_t, 4> kMark{'C', 'R', 'S', 1};  // the last byte is the version
constexpr std::size_t kMagic = 3;
constexpr std::size_t kNonce = crypto_aead_xchacha20poly1305_ietf_NPUBBYTES;
constexpr std::size_t kTag = crypto_aead_xchacha20poly1305_ietf_ABYTES;

static_assert(kMark.size() + kNonce + kTag == PacketSeal::kOverhead);
static_assert(crypto_aead_xchacha20poly1305_ietf_KEYBYTES == MeshKey::kSize);

std::shared_ptr<const MeshKey> locked(const MeshKey& key) {
  CREPES_EXPECT(sodium_init() >= 0, "the system has random numbers");
  void* const memory = sodium_malloc(sizeof(MeshKey));
  CREPES_EXPECT(memory != nullptr, "there is memory for a key");
  return {new (memory) MeshKey(key), sodium_free};
}

}  // namespace

MeshKey::~MeshKey() { sodium_memzero(bytes.data(), bytes.size()); }

PacketSeal::PacketSeal(const MeshKey& key) : key_(locked(key)) {}

std::vector<std::uint8_t> PacketSeal::seal(std::span<const std::uint8_t> plain) const {
  std::vector<std::uint8_t> sealed(plain.size() + kOverhead);
  std::uint8_t* const nonce = std::ranges::copy(kMark, sealed.data()).out;
  randombytes_buf(nonce, kNonce);
  crypto_aead_xchacha20poly1305_ietf_encrypt(nonce + kNonce, nullptr, plain.data(), plain.size(),
                                             kMark.data(), kMark.size(), nullptr, nonce,
                                             key_->bytes.data());
  return sealed;
}

tl::expected<std::vector<std::uint8_t>, UnsealError> PacketSeal::open(
    std::span<const std::uint8_t> sealed) const {
  if (!is_sealed(sealed)) return tl::unexpected(UnsealError::kNotSealed);
  if (sealed.size() < kOverhead) return tl::unexpected(UnsealError::kNotAuthentic);
  if (sealed[kMagic] != kMark[kMagic]) return tl::unexpected(UnsealError::kOtherVersion);
  const auto nonce = sealed.subspan(kMark.size(), kNonce);
  const auto secret = sealed.subspan(kMark.size() + kNonce);
  std::vector<std::uint8_t> plain(secret.size() - kTag);
  const int verdict = crypto_aead_xchacha20poly1305_ietf_decrypt(
      plain.data(), nullptr, nullptr, secret.data(), secret.size(), kMark.data(), kMark.size(),
      nonce.data(), key_->bytes.data());
  if (verdict != 0) return tl::unexpected(UnsealError::kNotAuthentic);
  return plain;
}

bool PacketSeal::is_sealed(std::span<const std::uint8_t> datagram) {
  return datagram.size() >= kMark.size() &&
         std::equal(kMark.begin(), kMark.begin() + kMagic, datagram.begin());
}

}  // namespace crepes
