#include "net/subscription/keyed_hash.hpp"

#include <sodium.h>

#include <bit>

#include "net/mesh/byte_writer.hpp"

namespace crepes {

std::uint64_t keyed_hash(const HashKey& key, const Endpoint& endpoint, std::uint64_t number) {
  static_assert(crypto_shorthash_KEYBYTES == std::tuple_size_v<HashKey>);
  static_assert(crypto_shorthash_BYTES == sizeof(std::uint64_t));
  ByteWriter bytes(64);
  for (const std::uint8_t byte : endpoint.address) bytes.write<std::uint8_t>(byte);
  bytes.write<std::uint32_t>(endpoint.scope);
  bytes.write<std::uint16_t>(endpoint.port);
  bytes.write<std::uint64_t>(number);
  std::array<std::uint8_t, crypto_shorthash_BYTES> hash{};
  crypto_shorthash(hash.data(), bytes.bytes().data(), bytes.bytes().size(), key.data());
  return std::bit_cast<std::uint64_t>(hash);
}

}  // namespace crepes
