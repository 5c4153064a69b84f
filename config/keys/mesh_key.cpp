#include "config/keys/mesh_key.hpp"

#include <sodium.h>

#include <array>

#include "config/keys/key_file.hpp"

namespace crepes {

Result<MeshKey> write_mesh_key(const std::filesystem::path& file) {
  MeshKey key{};
  randombytes_buf(key.bytes.data(), key.bytes.size());
  if (auto written = write_key_file(file, key.bytes); !written)
    return tl::unexpected(written.error());
  return key;
}

Result<MeshKey> read_mesh_key(const std::filesystem::path& file) {
  MeshKey key{};
  if (auto read = read_key_file(file, key.bytes); !read) return tl::unexpected(read.error());
  return key;
}

std::string fingerprint(const MeshKey& key) {
  std::array<std::uint8_t, crypto_generichash_BYTES> hash{};
  crypto_generichash(hash.data(), hash.size(), key.bytes.data(), key.bytes.size(), nullptr, 0);
  std::array<char, 9> text{};
  sodium_bin2hex(text.data(), text.size(), hash.data(), 4);
  return text.data();
}

}  // namespace crepes
