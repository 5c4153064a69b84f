#include "daemon/ctl/live/live_screen.hpp"

#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <sstream>
#include <string_view>

namespace crepes {
namespace {

/// Of the terminal at standard output; as of old where it does not say.
winsize size_of_terminal() {
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_row == 0 || size.ws_col == 0)
    size = {.ws_row = 24, .ws_col = 80, .ws_xpixel = 0, .ws_ypixel = 0};
  return size;
}

std::string_view environment(const char* name) {
  const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): nothing sets it
  return value == nullptr ? std::string_view() : value;
}

}  // namespace

ScreenFormat format_of_output() {
  if (::isatty(STDOUT_FILENO) != 1) return {};
  return {.columns = size_of_terminal().ws_col,
          .is_interactive = false,
          .has_color = environment("NO_COLOR").empty() && environment("TERM") != "dumb"};
}

StopSignals::StopSignals() {
  sigemptyset(&signals_);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) sigaddset(&signals_, signal);
  pthread_sigmask(SIG_BLOCK, &signals_, &before_);
}

/// A SIGPIPE that still waits would end the program at once.
StopSignals::~StopSignals() {
  sigset_t pipe{};
  sigemptyset(&pipe);
  sigaddset(&pipe, SIGPIPE);
  const timespec at_once{};
  sigtimedwait(&pipe, nullptr, &at_once);
  pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

bool StopSignals::requested() {
  const timespec at_once{};
  if (sigtimedwait(&signals_, nullptr, &at_once) > 0) requested_ = true;
  return requested_;
}

bool print(const std::string& text) {
  const bool is_taken = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  return std::fflush(stdout) == 0 && is_taken;
}

KeyReader::KeyReader() {
  termios settings{};
  // A background process must not change the terminal.
  if (::tcgetattr(STDIN_FILENO, &settings) != 0 || ::tcgetpgrp(STDIN_FILENO) != ::getpgrp()) return;
  before_ = settings;
  settings.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  ::tcsetattr(STDIN_FILENO, TCSANOW, &settings);
}

KeyReader::~KeyReader() {
  if (before_) ::tcsetattr(STDIN_FILENO, TCSANOW, &*before_);
}

std::optional<char> KeyReader::next() const {
  pollfd typed{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
  char key = 0;
  if (!before_ || ::poll(&typed, 1, 0) <= 0 || ::read(STDIN_FILENO, &key, 1) != 1)
    return std::nullopt;
  return key;
}

LiveScreen::LiveScreen() : is_terminal_(::isatty(STDOUT_FILENO) == 1) {
  if (is_terminal_) print("\x1b[?1049h\x1b[?25l");  // second screen, no cursor
}

LiveScreen::~LiveScreen() {
  if (is_terminal_) print("\x1b[?25h\x1b[?1049l");
}

void LiveScreen::show(const std::string& text) const {
  if (!is_terminal_) {
    print(text + "\n");
    return;
  }
  const winsize size = size_of_terminal();
  std::string screen = "\x1b[H";
  std::istringstream lines(text);
  std::string line;
  for (int row = 1; row < size.ws_row && std::getline(lines, line); ++row)
    screen += "\x1b[K" + cut(line, size.ws_col) + "\n";
  print(screen + "\x1b[J");
}

}  // namespace crepes
