#include "daemon/service/logging.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <string>

#include "drivers/base/monotonic_clock.hpp"
#include "drivers/base/sleep.hpp"
#include "drivers/base/unique_fd.hpp"

namespace crepes::logging_test {
namespace {

using namespace std::chrono_literals;

constexpr int kLines = 3000;  // more than a pipe and the queue hold

/// A daemon that logs to a pipe, in a process of its own: it might never end.
pid_t log_to(int pipe) {
  const pid_t child = ::fork();
  if (child != 0) return child;
  ::dup2(pipe, STDERR_FILENO);
  {
    const LogSession log(LogLevel::kInfo);
    for (int i = 0; i < kLines; ++i) log_message(LogLevel::kInfo, std::string(100, 'x'));
  }
  ::_exit(0);
}

/// Whether the process ends in time; it is killed otherwise.
bool ends_within(pid_t child, Duration patience) {
  const MonotonicClock clock;
  const Timestamp end = clock.now() + patience;
  while (clock.now() < end) {
    if (::waitpid(child, nullptr, WNOHANG) == child) return true;
    sleep_for(20ms);
  }
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  return false;
}

TEST(LogSession, EndsThoughNobodyReadsWhatItWrites) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe(ends.data()), 0);
  const UniqueFd reader(ends[0]);
  const UniqueFd writer(ends[1]);

  EXPECT_TRUE(ends_within(log_to(writer.get()), 2500ms));  // systemd kills after 3 s
}

TEST(LogSession, WritesToWhoeverReads) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe(ends.data()), 0);
  const UniqueFd reader(ends[0]);
  UniqueFd writer(ends[1]);

  const pid_t child = log_to(writer.get());
  writer = UniqueFd();
  std::string text;
  std::array<char, 4096> chunk{};
  for (ssize_t n = 1; n > 0; text.append(chunk.data(), static_cast<std::size_t>(n)))
    n = std::max<ssize_t>(0, ::read(reader.get(), chunk.data(), chunk.size()));

  EXPECT_TRUE(ends_within(child, 2500ms));
  EXPECT_NE(text.find("[crepesd] [info] xxx"), std::string::npos) << text.substr(0, 200);
  EXPECT_TRUE(text.ends_with("xxx\n"));
}

}  // namespace
}  // namespace crepes::logging_test
