#include "config/keys/key_file.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>

#include "drivers/base/unique_fd.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

tl::unexpected<Error> refuse(const fs::path& file, const std::string& reason) {
  return fail(ErrorCode::kIo, fmt::format("{}: {}", file.string(), reason));
}

tl::unexpected<Error> refuse_for(const fs::path& file, int error) {
  return refuse(file, std::generic_category().message(error));
}

}  // namespace

Result<void> write_key_file(const fs::path& file, std::span<const std::uint8_t> key) {
  constexpr mode_t kOwnerOnly = 0600;
  const UniqueFd fd{::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kOwnerOnly)};
  if (!fd && errno == EEXIST)
    return refuse(file, "is there already; a key that is in use is not overwritten");
  if (!fd) return refuse_for(file, errno);
  errno = ENOSPC;  // the likely reason for a short write
  const bool is_whole = ::write(fd.get(), key.data(), key.size()) == std::ssize(key);
  if (is_whole && ::fsync(fd.get()) == 0) return {};
  const int error = errno;
  ::unlink(file.c_str());
  return refuse_for(file, error);
}

Result<void> read_key_file(const fs::path& file, std::span<std::uint8_t> key) {
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
  const ssize_t read = ::read(fd.get(), key.data(), key.size());
  if (read < 0) return refuse_for(file, errno);
  if (read != std::ssize(key) || about.st_size != std::ssize(key)) {
    return refuse(file,
                  fmt::format("expected a key of {} bytes, as crepesctl keygen makes it, found {}",
                              key.size(), about.st_size));
  }
  return {};
}

}  // namespace crepes
