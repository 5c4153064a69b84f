#include "daemon/ctl/commands/command_line.hpp"

#include <unistd.h>

#include <cstdio>
#include <fstream>

#include "daemon/ctl/live_screen.hpp"

namespace crepes {

void add_daemon_options(CLI::App* sub, DaemonAddress& daemon) {
  sub->add_option("--address", daemon.address, "where the daemon serves poses")
      ->capture_default_str();
  sub->add_option("--port", daemon.port, "its UDP port")
      ->capture_default_str()
      ->check(CLI::Range(1, 65535));
}

Result<void> print_result(const Result<std::string>& text) {
  return text.map([](const std::string& t) { print(t); });
}

Result<void> deliver(const std::string& text, const std::string& file) {
  if (file.empty()) {
    print(text);
    return {};
  }
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (!out) return fail(ErrorCode::kIo, file + ": cannot be written");
  return {};
}

std::function<void(double)> progress_on_terminal() {
  if (::isatty(STDERR_FILENO) != 1) return {};
  return [](double share) { std::fprintf(stderr, "\r%3.0f %%\r", 100.0 * share); };
}

}  // namespace crepes
