/// Messages for people: to stderr, or to the journal when systemd started us.
#pragma once

#include <string>

#include "estimator/core/config.hpp"

namespace crepes {

/// From construction to destruction messages go out, by a thread of spdlog's own: it may lose lines
/// when overrun, never time. One at a time.
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

/// Thread-safe. Without a LogSession lines go to stdout at once.
void log_message(LogLevel level, const std::string& message);

}  // namespace crepes
