/// A table that renews itself in a terminal, and a polite way to be stopped.
#pragma once

#include <termios.h>

#include <csignal>
#include <optional>
#include <string>

namespace crepes {

/// Holds back SIGINT, SIGTERM and SIGHUP while it lives, so that what was started gets stopped.
class StopSignals {
 public:
  StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;
  StopSignals(StopSignals&&) = delete;
  StopSignals& operator=(StopSignals&&) = delete;
  ~StopSignals();

  /// Whether one of them has come.
  [[nodiscard]] bool requested();

 private:
  sigset_t signals_{};
  sigset_t before_{};
  bool requested_ = false;
};

/// Standard output: the terminal's second screen, given back by the destructor; or, if it is not a
/// terminal, plain lines.
class LiveScreen {
 public:
  LiveScreen();
  LiveScreen(const LiveScreen&) = delete;
  LiveScreen& operator=(const LiveScreen&) = delete;
  LiveScreen(LiveScreen&&) = delete;
  LiveScreen& operator=(LiveScreen&&) = delete;
  ~LiveScreen();

  [[nodiscard]] bool is_terminal() const { return is_terminal_; }

  /// Shows `text` in place of what was there; lines that do not fit the terminal are cut.
  void show(const std::string& text) const;

 private:
  bool is_terminal_;
};

/// Single keys from standard input while it lives, without echo; none if it is not a terminal.
class KeyReader {
 public:
  KeyReader();
  KeyReader(const KeyReader&) = delete;
  KeyReader& operator=(const KeyReader&) = delete;
  KeyReader(KeyReader&&) = delete;
  KeyReader& operator=(KeyReader&&) = delete;
  ~KeyReader();

  [[nodiscard]] bool is_terminal() const { return before_.has_value(); }
  /// The next byte that was typed, if there is one; never waits.
  [[nodiscard]] std::optional<char> next() const;

 private:
  std::optional<termios> before_;
};

/// Writes to standard output at once; false if nobody reads it.
bool print(const std::string& text);

}  // namespace crepes
