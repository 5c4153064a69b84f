#include "daemon/service/robot_lock.hpp"

#include <fmt/core.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <system_error>

namespace crepes {

Result<UniqueFd> lock_robot(RobotId robot, const std::string& interface, int port) {
  // A name that begins with a zero byte is in no file system (unix(7), abstract).
  const std::string name = fmt::format("crepesd {} {} {}", robot.value, port, interface);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::size_t length = std::min(name.size(), sizeof(address.sun_path) - 1);
  std::copy_n(name.begin(), length, address.sun_path + 1);
  UniqueFd fd{::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)};
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + length);
  if (fd && ::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), size) == 0) return fd;
  if (errno == EADDRINUSE) {
    return fail(ErrorCode::kBusy,
                fmt::format("a daemon with robot.id {} already runs on this machine (net.interface "
                            "{}, net.port {}): stop it, or give this robot its own id",
                            robot.value, interface, port));
  }
  return fail(ErrorCode::kIo,
              fmt::format("robot.id {}: {}", robot.value, std::generic_category().message(errno)));
}

}  // namespace crepes
