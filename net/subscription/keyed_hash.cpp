#include "net/subscription/keyed_hash.hpp"

#include <sodium.h>

#include <bit>

#include "net/mesh/bit_writer.hpp"

namespace crepes {

std::uint64_t keyed_hash(const HashKey& key, const Endpoint& endpoint, std::uint64_t number) {
  static_assert(crypto_shorthash_KEYBYTES == std::tuple_size_v<HashKey>);
  static_assert(crypto_shorthash_BYTES == sizeof(std::uint64_t));
  BitWriter writer;
  for (const std::uint8_t byte : endpoint.address) writer.bits(byte, 8);
  writer.bits(endpoint.scope, 32);
  writer.bits(endpoint.port, 16);
  writer.wide_bits(number, 64);
  const std::vector<std::uint8_t> bytes = std::move(writer).finished();
  std::array<std::uint8_t, crypto_shorthash_BYTES> hash{};
  crypto_shorthash(hash.data(), bytes.data(), bytes.size(), key.data());
  return std::bit_cast<std::uint64_t>(hash);
}

}  // namespace crepes
