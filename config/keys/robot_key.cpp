#include "config/keys/robot_key.hpp"

#include <sodium.h>

#include <array>

#include "config/keys/key_file.hpp"

namespace crepes {

Result<RobotKey> write_robot_key(const std::filesystem::path& file) {
  std::array<std::uint8_t, crypto_sign_SEEDBYTES> seed{};
  randombytes_buf(seed.data(), seed.size());
  const RobotKey key = robot_key_of(seed);
  sodium_memzero(seed.data(), seed.size());
  if (auto written = write_key_file(file, key.bytes); !written)
    return tl::unexpected(written.error());
  return key;
}

Result<RobotKey> read_robot_key(const std::filesystem::path& file) {
  RobotKey key{};
  if (auto read = read_key_file(file, key.bytes); !read) return tl::unexpected(read.error());
  if (!is_whole(key))
    return fail(ErrorCode::kIo, file.string() + ": is damaged, or no robot's own key");
  return key;
}

}  // namespace crepes
