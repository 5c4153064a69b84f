/// SIGINT, SIGTERM and SIGHUP as something to wait for.
#pragma once

#include <csignal>
#include <cstdint>
#include <ctime>

namespace crepes {

enum class Signal : std::uint8_t { kNone, kStop, kReload };

/// Make it before any thread: threads inherit that the signals are blocked, so only `wait` gets
/// them.
class Signals {
 public:
  Signals() {
    sigemptyset(&signals_);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals_, signal);
    ::pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  }

  /// What has come; kNone after a second without.
  [[nodiscard]] Signal wait_a_second() const {
    constexpr timespec kSecond{1, 0};
    const int signal = ::sigtimedwait(&signals_, nullptr, &kSecond);
    if (signal < 0) return Signal::kNone;
    return signal == SIGHUP ? Signal::kReload : Signal::kStop;
  }

 private:
  sigset_t signals_{};
};

}  // namespace crepes
