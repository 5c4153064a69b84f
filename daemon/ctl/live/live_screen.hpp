/// A terminal that is redrawn, key input, and stop signals.
#pragma once

#include <termios.h>

#include <csignal>
#include <optional>
#include <string>

#include "daemon/ctl/live/screen_text.hpp"

namespace crepes {

/// Blocks SIGINT, SIGTERM, SIGHUP and SIGPIPE (of an output that nobody reads any more) during its
/// lifetime, so that child processes and subscriptions can be ended first. What changes the
/// terminal is made after it: a second signal ends the program only when the terminal is restored.
class StopSignals {
 public:
  StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;
  StopSignals(StopSignals&&) = delete;
  StopSignals& operator=(StopSignals&&) = delete;
  ~StopSignals();

  /// Whether one of them has arrived.
  [[nodiscard]] bool requested();

 private:
  sigset_t signals_{};
  sigset_t before_{};
  bool requested_ = false;
};

/// The width of the terminal at standard output, and whether it shows colors: not where the
/// environment has NO_COLOR (no-color.org) or TERM=dumb. A file has room for all columns.
[[nodiscard]] ScreenFormat format_of_output();

/// Standard output: the terminal's alternate screen, which the destructor leaves again. Plain lines
/// if it is not a terminal.
class LiveScreen {
 public:
  LiveScreen();
  LiveScreen(const LiveScreen&) = delete;
  LiveScreen& operator=(const LiveScreen&) = delete;
  LiveScreen(LiveScreen&&) = delete;
  LiveScreen& operator=(LiveScreen&&) = delete;
  ~LiveScreen();

  [[nodiscard]] bool is_terminal() const { return is_terminal_; }

  /// Replaces the text on the screen. Lines that do not fit are cut.
  void show(const std::string& text) const;

 private:
  bool is_terminal_;
};

/// Single keys from standard input during its lifetime, without echo. None if it is not a terminal.
class KeyReader {
 public:
  KeyReader();
  KeyReader(const KeyReader&) = delete;
  KeyReader& operator=(const KeyReader&) = delete;
  KeyReader(KeyReader&&) = delete;
  KeyReader& operator=(KeyReader&&) = delete;
  ~KeyReader();

  [[nodiscard]] bool is_terminal() const { return before_.has_value(); }
  /// The next typed byte, if there is one; never waits.
  [[nodiscard]] std::optional<char> next() const;

 private:
  std::optional<termios> before_;
};

/// Writes to standard output and flushes; false on a write error.
bool print(const std::string& text);

}  // namespace crepes
