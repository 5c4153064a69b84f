#include "daemon/service/robot_lock.hpp"

#include <fmt/core.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <system_error>
#include <utility>

namespace crepes {
namespace {

std::string name_of(RobotId robot, const std::string& interface, int port) {
  return interface == "lo" ? fmt::format("crepesd {} lo {}", robot.value, port)
                           : fmt::format("crepesd {}", robot.value);
}

}  // namespace

Result<RobotLock> RobotLock::claim(RobotId robot, const std::string& interface, int port) {
  // A name that begins with a zero byte is in no file system (unix(7), abstract).
  std::string name = name_of(robot, interface, port);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::size_t length = std::min(name.size(), sizeof(address.sun_path) - 1);
  std::copy_n(name.begin(), length, address.sun_path + 1);
  UniqueFd socket{::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)};
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + length);
  if (socket && ::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), size) == 0)
    return RobotLock(robot, std::move(name), std::move(socket));
  if (errno == EADDRINUSE) {
    return fail(ErrorCode::kBusy,
                fmt::format("a daemon with robot.id {} already runs on this machine: stop it, or "
                            "give this robot its own id",
                            robot.value));
  }
  return fail(ErrorCode::kIo,
              fmt::format("robot.id {}: {}", robot.value, std::generic_category().message(errno)));
}

Result<std::optional<RobotLock>> RobotLock::moved_to(const std::string& interface, int port) const {
  if (name_of(robot_, interface, port) == name_) return std::nullopt;
  return claim(robot_, interface, port).map([](RobotLock&& lock) {
    return std::optional(std::move(lock));
  });
}

}  // namespace crepes
