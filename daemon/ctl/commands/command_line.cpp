#include "daemon/ctl/commands/command_line.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <fstream>
#include <system_error>

#include "daemon/ctl/live/live_screen.hpp"

namespace crepes {

void add_daemon_options(CLI::App* sub, DaemonAddress& daemon) {
  sub->add_option("--address", daemon.address, "where the daemon serves poses")
      ->capture_default_str();
  sub->add_option("--port", daemon.port, "its UDP port")
      ->capture_default_str()
      ->check(CLI::Range(1, 65535));
}

void add_json_flag(CLI::App* sub, bool& json, const std::string& which) {
  sub->add_flag("--json", json, "JSON on standard output instead of text: " + which);
}

Result<void> print_result(const Result<std::string>& text) {
  if (!text) return tl::unexpected(text.error());
  if (print(*text)) return {};
  return fail(ErrorCode::kIo, "standard output: " + std::generic_category().message(errno));
}

Result<void> write_output(const std::string& text, const std::string& file) {
  if (file.empty()) return print_result(text);
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
