#include "drivers/serial/line_settings.hpp"

// The kernel's header has termios2, with rates as numbers. It conflicts with <termios.h>.
#include <asm/termbits.h>
#include <fmt/format.h>
#include <linux/serial.h>
#include <sys/ioctl.h>

#include <cstdlib>

#include "drivers/base/io_failure.hpp"

namespace crepes {
namespace {

/// Otherwise USB adapters buffer bytes for up to 16 ms. Adapters that never do (cdc_acm) refuse.
void prefer_low_latency(int fd) {
  serial_struct serial{};
  if (::ioctl(fd, TIOCGSERIAL, &serial) != 0) return;
  serial.flags |= ASYNC_LOW_LATENCY;
  static_cast<void>(::ioctl(fd, TIOCSSERIAL, &serial));
}

}  // namespace

Result<void> set_raw_line(int fd, int baud, const std::string& name) {
  const auto rate = static_cast<speed_t>(baud);
  termios2 settings{};
  if (::ioctl(fd, TCGETS2, &settings) != 0) return io_failure(name);
  settings.c_iflag = 0;
  settings.c_oflag = 0;
  settings.c_lflag = 0;
  settings.c_cflag = (settings.c_cflag & HUPCL) | CS8 | CREAD | CLOCAL | BOTHER;
  settings.c_ispeed = rate;
  settings.c_ospeed = rate;
  settings.c_cc[VMIN] = 1;
  settings.c_cc[VTIME] = 0;
  if (::ioctl(fd, TCSETS2, &settings) != 0) return io_failure(name);

  // The driver selects the nearest supported rate without an error, and reports it.
  termios2 taken{};
  if (::ioctl(fd, TCGETS2, &taken) != 0) return io_failure(name);
  const long off = std::labs(static_cast<long>(taken.c_ospeed) - baud);
  if (50 * off > baud) {
    return fail(ErrorCode::kIo,
                fmt::format("{}: the device makes {} baud of {}", name, taken.c_ospeed, baud));
  }
  if (::ioctl(fd, TIOCEXCL) != 0) return io_failure(name);
  prefer_low_latency(fd);
  static_cast<void>(::ioctl(fd, TCFLSH, TCIFLUSH));
  return {};
}

}  // namespace crepes
