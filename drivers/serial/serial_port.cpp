#include "drivers/serial/serial_port.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/file.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "drivers/serial/device_name.hpp"
#include "drivers/serial/line_settings.hpp"

namespace crepes {
namespace {

tl::unexpected<Error> io_error(const std::string& path, int error) {
  const ErrorCode code = error == ENOENT ? ErrorCode::kNotFound : ErrorCode::kIo;
  const char* const hint = error == EACCES ? "; is the user in the group dialout?" : "";
  return fail(code, fmt::format("{}: {}{}", path, std::generic_category().message(error), hint));
}

tl::unexpected<Error> busy(const std::string& path) {
  return fail(ErrorCode::kIo, fmt::format("{}: in use by {}", path,
                                          process_using(path).value_or("another program")));
}

}  // namespace

Result<SerialPort> SerialPort::open(const std::string& path, int baud) {
  UniqueFd fd{::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)};
  if (!fd) return errno == EBUSY ? busy(path) : io_error(path, errno);
  // TIOCEXCL excludes programs that do not lock; the lock excludes programs that run as root.
  if (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) {
    const int error = errno;
    fd = UniqueFd();
    return error == EWOULDBLOCK ? busy(path) : io_error(path, error);
  }
  return set_raw_line(fd.get(), baud, path).map([&] { return SerialPort(std::move(fd), path); });
}

Result<Bytes> SerialPort::read_some(std::chrono::milliseconds timeout) {
  pollfd waiting{.fd = fd_.get(), .events = POLLIN, .revents = 0};
  const int ready = ::poll(&waiting, 1, static_cast<int>(timeout.count()));
  if (ready < 0 && errno != EINTR) return io_error(path_, errno);
  if (ready <= 0) return Bytes{};

  const ssize_t count = ::read(fd_.get(), buffer_.data(), buffer_.size());
  if (count > 0) return Bytes(buffer_).first(static_cast<std::size_t>(count));
  constexpr int kGone = POLLHUP | POLLERR | POLLNVAL;
  if (count < 0 && (errno == EAGAIN || errno == EINTR) && (waiting.revents & kGone) == 0) {
    return Bytes{};
  }
  if (count < 0 && errno != EIO && errno != EAGAIN) return io_error(path_, errno);
  return fail(ErrorCode::kIo, fmt::format("{}: hung up", path_));
}

Result<void> SerialPort::write_all(Bytes bytes, std::chrono::milliseconds timeout) {
  while (!bytes.empty()) {
    pollfd waiting{.fd = fd_.get(), .events = POLLOUT, .revents = 0};
    const int ready = ::poll(&waiting, 1, static_cast<int>(timeout.count()));
    if (ready < 0 && errno != EINTR) return io_error(path_, errno);
    if (ready == 0) return fail(ErrorCode::kIo, fmt::format("{}: takes no bytes", path_));
    const ssize_t count = ::write(fd_.get(), bytes.data(), bytes.size());
    if (count < 0 && errno != EAGAIN && errno != EINTR) return io_error(path_, errno);
    if (count > 0) bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return {};
}

}  // namespace crepes
