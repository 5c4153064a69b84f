/// Log messages: to stderr, or to the journal if systemd started the daemon.
#pragma once

#include <string>

#include "config/schema/config.hpp"

namespace crepes {

/// Logging is active from construction to destruction, in a thread of spdlog. Under overload, and
/// where nobody reads, it drops lines but never blocks. Only one object may exist at a time.
class LogSession {
 public:
  explicit LogSession(LogLevel least);
  LogSession(const LogSession&) = delete;
  LogSession& operator=(const LogSession&) = delete;
  LogSession(LogSession&&) = delete;
  LogSession& operator=(LogSession&&) = delete;
  ~LogSession();
};

/// Thread-safe.
void set_log_level(LogLevel least);

/// Thread-safe. Without a LogSession, lines go to stdout immediately.
void log_message(LogLevel level, const std::string& message);

}  // namespace crepes
