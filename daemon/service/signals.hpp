/// SIGINT, SIGTERM and SIGHUP as values to wait for.
#pragma once

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <ctime>

#include "estimator/core/time.hpp"

namespace crepes {

/// What a signal asks for.
enum class Signal : std::uint8_t { kNone, kStop, kReload };

/// Construct it before any thread starts. Threads inherit the blocked signals, so that only
/// `wait_for` receives them.
class Signals {
 public:
  Signals() {
    sigemptyset(&signals_);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals_, signal);
    ::pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
    std::signal(SIGPIPE, SIG_IGN);  // who reads the log may go
  }

  /// The signal that arrived; kNone after `longest` without one. Does not wait if it is negative.
  [[nodiscard]] Signal wait_for(Duration longest) const {
    const auto ns = std::max<std::int64_t>(longest.count(), 0);
    const timespec timeout{ns / 1'000'000'000, ns % 1'000'000'000};
    const int signal = ::sigtimedwait(&signals_, nullptr, &timeout);
    if (signal < 0) return Signal::kNone;
    return signal == SIGHUP ? Signal::kReload : Signal::kStop;
  }

 private:
  sigset_t signals_{};
};

}  // namespace crepes
