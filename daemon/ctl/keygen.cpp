#include "daemon/ctl/keygen.hpp"

#include <fcntl.h>
#include <sodium.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>

#include "drivers/unique_fd.hpp"

namespace crepes {
namespace {

tl::unexpected<Error> fail_errno(const std::filesystem::path& file, int error) {
  const std::string advice = error == EEXIST ? "; a key that is in use is not overwritten" : "";
  return fail(ErrorCode::kIo,
              file.string() + ": " + std::generic_category().message(error) + advice);
}

}  // namespace

Result<void> write_mesh_key(const std::filesystem::path& file) {
  constexpr mode_t kOwnerOnly = 0600;
  const UniqueFd fd{::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kOwnerOnly)};
  if (!fd) return fail_errno(file, errno);
  std::array<std::uint8_t, 32> key{};
  randombytes_buf(key.data(), key.size());
  const ssize_t written = ::write(fd.get(), key.data(), key.size());
  const int error = written < 0 ? errno : ENOSPC;
  sodium_memzero(key.data(), key.size());
  if (written == static_cast<ssize_t>(key.size()) && ::fsync(fd.get()) == 0) return {};
  ::unlink(file.c_str());
  return fail_errno(file, error);
}

}  // namespace crepes
