#include "tests/faults/in_child.hpp"

#include <fmt/core.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>

#include "drivers/base/unique_fd.hpp"

namespace crepes::faults {
namespace {

/// An exception ends the process by a signal, as it would end the daemon.
[[noreturn]] void run(const std::function<std::string()>& function, int out) noexcept {
  const std::string text = function();
  for (std::size_t at = 0; at < text.size();) {
    const ssize_t written = ::write(out, text.data() + at, text.size() - at);
    if (written <= 0) ::_exit(1);
    at += static_cast<std::size_t>(written);
  }
  ::_exit(0);
}

std::string crash_of(int status) {
  if (WIFSIGNALED(status)) return fmt::format("died of signal {}", WTERMSIG(status));
  return WEXITSTATUS(status) == 0 ? "" : fmt::format("ended with {}", WEXITSTATUS(status));
}

}  // namespace

ChildResult in_child(const std::function<std::string()>& function) {
  std::array<int, 2> ends{};
  if (::pipe(ends.data()) != 0) std::abort();
  const UniqueFd in(ends[0]);
  UniqueFd out(ends[1]);
  std::fflush(nullptr);
  const pid_t child = ::fork();
  if (child == 0) run(function, out.get());
  out = UniqueFd();
  ChildResult result;
  std::array<char, 4096> bytes{};
  for (ssize_t size = 0; (size = ::read(in.get(), bytes.data(), bytes.size())) > 0;)
    result.text.append(bytes.data(), static_cast<std::size_t>(size));
  int status = 0;
  ::waitpid(child, &status, 0);
  result.crash = crash_of(status);
  return result;
}

}  // namespace crepes::faults
