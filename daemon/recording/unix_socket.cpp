#include "daemon/recording/unix_socket.hpp"

#include <fmt/core.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>

namespace crepes {
namespace {

tl::unexpected<Error> failure(const std::string& path) {
  return fail(ErrorCode::kIo, fmt::format("{}: {}", path, std::generic_category().message(errno)));
}

template <class Call>
Result<UniqueFd> open_with(const std::string& path, int flags, Call call) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof(address.sun_path))
    return fail(ErrorCode::kConfig, path + ": too long for the name of a socket");
  std::ranges::copy(path, std::begin(address.sun_path));
  UniqueFd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | flags, 0));
  const void* const raw = &address;  // the kernel accepts addresses of any family this way
  if (!fd || call(fd.get(), static_cast<const sockaddr*>(raw), sizeof(address)) != 0)
    return failure(path);
  return fd;
}

/// A symbolic link is none.
bool is_socket(const std::string& path) {
  struct stat found {};
  return ::lstat(path.c_str(), &found) == 0 && S_ISSOCK(found.st_mode);
}

}  // namespace

Result<UniqueFd> connect_unix(const std::string& path, int flags) {
  return open_with(path, flags, ::connect);
}

Result<UniqueFd> listen_unix(const std::string& path) {
  Result<UniqueFd> socket = open_with(path, SOCK_NONBLOCK, ::bind);
  if (!socket && errno == EADDRINUSE) {
    if (!is_socket(path)) return fail(ErrorCode::kConfig, path + ": is there and is no socket");
    // EAGAIN: others wait there already.
    if (connect_unix(path, SOCK_NONBLOCK) || errno == EAGAIN)
      return fail(ErrorCode::kIo, path + ": another daemon listens there");
    if (errno != ECONNREFUSED || ::unlink(path.c_str()) != 0) return failure(path);
    socket = open_with(path, SOCK_NONBLOCK, ::bind);
  }
  if (!socket) return socket;
  constexpr mode_t kOwnerAndGroup = 0660;
  if (::chmod(path.c_str(), kOwnerAndGroup) != 0 || ::listen(socket->get(), 1) != 0)
    return failure(path);
  return socket;
}

}  // namespace crepes
