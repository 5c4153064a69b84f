#include "drivers/serial/serial_port.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

namespace crepes {
namespace {

constexpr std::array<std::pair<int, speed_t>, 22> kRates{
    {{1200, B1200},       {1800, B1800},       {2400, B2400},       {4800, B4800},
     {9600, B9600},       {19200, B19200},     {38400, B38400},     {57600, B57600},
     {115200, B115200},   {230400, B230400},   {460800, B460800},   {500000, B500000},
     {576000, B576000},   {921600, B921600},   {1000000, B1000000}, {1152000, B1152000},
     {1500000, B1500000}, {2000000, B2000000}, {2500000, B2500000}, {3000000, B3000000},
     {3500000, B3500000}, {4000000, B4000000}}};

tl::unexpected<Error> io_error(const std::string& path, int error) {
  return fail(ErrorCode::kIo, path + ": " + std::generic_category().message(error));
}

Result<void> configure_raw(int fd, const std::string& path, int baud) {
  const auto* const rate =
      std::find_if(kRates.begin(), kRates.end(), [&](const auto& r) { return r.first == baud; });
  if (rate == kRates.end()) {
    return fail(ErrorCode::kConfig, path + ": " + std::to_string(baud) + " is not a standard rate");
  }
  termios settings{};
  if (::tcgetattr(fd, &settings) != 0) return io_error(path, errno);
  ::cfmakeraw(&settings);
  settings.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cc[VMIN] = 1;
  settings.c_cc[VTIME] = 0;
  if (::cfsetspeed(&settings, rate->second) != 0 || ::tcsetattr(fd, TCSANOW, &settings) != 0) {
    return io_error(path, errno);
  }
  // tcsetattr is content when any one setting was taken.
  termios taken{};
  if (::tcgetattr(fd, &taken) != 0) return io_error(path, errno);
  if (::cfgetispeed(&taken) != rate->second) {
    return fail(ErrorCode::kIo,
                path + ": the device does not take " + std::to_string(baud) + " baud");
  }
  return {};
}

/// TIOCEXCL keeps out programs that do not lock; flock keeps out those that run as root.
Result<void> take_for_ourselves(int fd, const std::string& path) {
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0) {
    if (errno == EWOULDBLOCK) return fail(ErrorCode::kIo, path + ": in use by another program");
    return io_error(path, errno);
  }
  if (::ioctl(fd, TIOCEXCL) != 0) return io_error(path, errno);
  return {};
}

}  // namespace

Result<SerialPort> SerialPort::open(const std::string& path, int baud) {
  UniqueFd fd{::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)};
  if (!fd) return io_error(path, errno);
  return take_for_ourselves(fd.get(), path)
      .and_then([&] { return configure_raw(fd.get(), path, baud); })
      .map([&] {
        ::tcflush(fd.get(), TCIFLUSH);
        return SerialPort(std::move(fd), path);
      });
}

Result<Bytes> SerialPort::read_some(std::chrono::milliseconds timeout) {
  pollfd waiting{.fd = fd_.get(), .events = POLLIN, .revents = 0};
  const int ready = ::poll(&waiting, 1, static_cast<int>(timeout.count()));
  if (ready < 0 && errno != EINTR) return io_error(path_, errno);
  if (ready <= 0) return Bytes{};

  const ssize_t count = ::read(fd_.get(), buffer_.data(), buffer_.size());
  if (count > 0) return Bytes(buffer_).first(static_cast<std::size_t>(count));
  if (count < 0 && (errno == EAGAIN || errno == EINTR) && (waiting.revents & POLLHUP) == 0) {
    return Bytes{};
  }
  if (count < 0 && errno != EIO && errno != EAGAIN) return io_error(path_, errno);
  return fail(ErrorCode::kIo, path_ + ": hung up");
}

Result<void> SerialPort::write_all(Bytes bytes, std::chrono::milliseconds timeout) {
  while (!bytes.empty()) {
    pollfd waiting{.fd = fd_.get(), .events = POLLOUT, .revents = 0};
    const int ready = ::poll(&waiting, 1, static_cast<int>(timeout.count()));
    if (ready < 0 && errno != EINTR) return io_error(path_, errno);
    if (ready == 0) return fail(ErrorCode::kIo, path_ + ": takes no bytes");
    const ssize_t count = ::write(fd_.get(), bytes.data(), bytes.size());
    if (count < 0 && errno != EAGAIN && errno != EINTR) return io_error(path_, errno);
    if (count > 0) bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return {};
}

}  // namespace crepes
