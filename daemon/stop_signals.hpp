/// SIGINT and SIGTERM as something to wait for.
#pragma once

#include <csignal>
#include <ctime>

namespace crepes {

/// Make it before any thread: threads inherit that the signals are blocked, so only `wait` gets
/// them.
class StopSignals {
 public:
  StopSignals() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGINT);
    sigaddset(&signals_, SIGTERM);
    ::pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  }

  /// True once one has come; false after a second without.
  [[nodiscard]] bool came_within_a_second() const {
    constexpr timespec kSecond{1, 0};
    return ::sigtimedwait(&signals_, nullptr, &kSecond) >= 0;
  }

 private:
  sigset_t signals_{};
};

}  // namespace crepes
