#include "config/keys/mesh_key.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>

#include "drivers/base/unique_fd.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

constexpr ssize_t kKeyBytes = MeshKey::kSize;

tl::unexpected<Error> refuse(const fs::path& file, const std::string& reason) {
  return fail(ErrorCode::kIo, fmt::format("{}: {}", file.string(), reason));
}

tl::unexpected<Error> refuse_for(const fs::path& file, int error) {
  return refuse(file, std::generic_category().message(error));
}

}  // namespace

Result<MeshKey> write_mesh_key(const fs::path& file) {
  constexpr mode_t kOwnerOnly = 0600;
  const UniqueFd fd{::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kOwnerOnly)};
  if (!fd && errno == EEXIST)
    return refuse(file, "is there already; a key that is in use is not overwritten");
  if (!fd) return refuse_for(file, errno);
  MeshKey key{};
  randombytes_buf(key.bytes.data(), key.bytes.size());
  errno = ENOSPC;  // the likely reason for a short write
  const bool is_whole = ::write(fd.get(), key.bytes.data(), key.bytes.size()) == kKeyBytes;
  if (is_whole && ::fsync(fd.get()) == 0) return key;
  const int error = errno;
  ::unlink(file.c_str());
  return refuse_for(file, error);
}

Result<MeshKey> read_mesh_key(const fs::path& file) {
  // Opening a pipe would block.
  const UniqueFd fd{::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
  if (!fd && errno == EACCES) {
    return refuse(file,
                  "Permission denied; the service is of group crepes: chgrp crepes, chmod 640");
  }
  if (!fd) return refuse_for(file, errno);
  struct stat about {};
  if (::fstat(fd.get(), &about) != 0) return refuse_for(file, errno);
  if (!S_ISREG(about.st_mode)) return refuse(file, "is not a file");
  if ((about.st_mode & S_IRWXO) != 0)
    return refuse(file, "is open to everybody; chmod o= " + file.string());
  MeshKey key{};
  const ssize_t read = ::read(fd.get(), key.bytes.data(), key.bytes.size());
  if (read < 0) return refuse_for(file, errno);
  if (read != kKeyBytes || about.st_size != kKeyBytes) {
    return refuse(file,
                  fmt::format("expected a key of 32 bytes, as crepesctl keygen makes it, found {}",
                              about.st_size));
  }
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
