#include "drivers/sim/pseudo_terminal.hpp"

#include <fcntl.h>
#include <poll.h>
#include <termios.h>

#include <array>
#include <cstdlib>

#include "drivers/base/io_failure.hpp"

namespace crepes {

Result<PseudoTerminal> PseudoTerminal::open() {
  const std::string name = "pseudo-terminal";
  UniqueFd master{::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)};
  if (!master || ::grantpt(master.get()) != 0 || ::unlockpt(master.get()) != 0)
    return io_failure(name);
  std::array<char, 128> path{};
  if (::ptsname_r(master.get(), path.data(), path.size()) != 0) return io_failure(name);
  // Raw mode before the other end is opened: bytes received until then must not be echoed.
  termios settings{};
  if (::tcgetattr(master.get(), &settings) != 0) return io_failure(name);
  ::cfmakeraw(&settings);
  if (::tcsetattr(master.get(), TCSANOW, &settings) != 0) return io_failure(name);
  return PseudoTerminal(std::move(master), path.data());
}

std::size_t PseudoTerminal::write(std::span<const std::uint8_t> bytes) {
  const ssize_t count = ::write(master_.get(), bytes.data(), bytes.size());
  return count > 0 ? static_cast<std::size_t>(count) : 0;
}

std::vector<std::uint8_t> PseudoTerminal::read(std::chrono::milliseconds timeout) {
  pollfd waiting{.fd = master_.get(), .events = POLLIN, .revents = 0};
  if (::poll(&waiting, 1, static_cast<int>(timeout.count())) <= 0) return {};
  std::vector<std::uint8_t> bytes(4096);
  const ssize_t count = ::read(master_.get(), bytes.data(), bytes.size());
  bytes.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
  return bytes;
}

}  // namespace crepes
