/// The daemon: options, configuration, Runtime, wait.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <iostream>
#include <string>
#include <utility>

#include "config/reading/config_file.hpp"
#include "daemon/runtime.hpp"
#include "daemon/service/logging.hpp"
#include "daemon/service/reload.hpp"
#include "daemon/service/robot_lock.hpp"
#include "daemon/service/signals.hpp"
#include "daemon/service/watchdog.hpp"
#include "daemon/version.hpp"
#include "drivers/base/monotonic_clock.hpp"
#include "drivers/base/sleep.hpp"

namespace crepes {
namespace {

constexpr int kDone = 0;
constexpr int kBadInput = 1;
constexpr int kBadUsage = 2;
constexpr int kRobotTaken = 3;  // systemd tries again: the other daemon may end

constexpr Duration kCheckPeriod = std::chrono::seconds{1};  // of the watchdog

int print(const Result<std::string>& text) {
  (text ? std::cout << *text : std::cerr << text.error().message << '\n') << std::flush;
  if (text && !std::cout) std::cerr << "standard output: cannot be written\n";
  return text && std::cout ? kDone : kBadInput;
}

void print_lines(const std::string& prefix, const std::vector<ConfigFault>& faults) {
  for (const ConfigFault& fault : faults) std::cerr << prefix << to_string(fault) << '\n';
  std::cerr << std::flush;
}

int check(const std::string& file, bool strict) {
  const CheckedConfig checked = check_config(file);
  print_lines("", checked.faults);
  print_lines("warning: ", checked.warnings);
  if (!checked.faults.empty() || (strict && !checked.warnings.empty())) return kBadInput;
  return print(file + ": good\n");
}

/// Waits a little for a daemon that is ending. So systemd, which starts this one again, does not do
/// so ten times a second.
Result<RobotLock> claim_robot(const Config& config) {
  constexpr int kTries = 20;
  constexpr Duration kPause = std::chrono::milliseconds{100};
  const auto claim = [&config] {
    return RobotLock::claim(config.robot.id, config.net.interface, config.net.port);
  };
  Result<RobotLock> lock = claim();
  for (int i = 1; i < kTries && !lock && lock.error().code == ErrorCode::kBusy; ++i) {
    sleep_for(kPause);
    lock = claim();
  }
  return lock;
}

int run(const std::string& file) {
  CheckedConfig checked = check_config(file);
  print_lines("", checked.faults);
  if (!checked.faults.empty()) return kBadInput;
  Config* const config = &checked.config;
  auto lock = claim_robot(*config);
  if (!lock) {
    print(tl::unexpected(lock.error()));
    return lock.error().code == ErrorCode::kBusy ? kRobotTaken : kBadInput;
  }
  const Signals signals;
  const LogSession log(config->log.level);
  const MonotonicClock machine;
  const std::string start =
      fmt::format("crepesd {}, robot {}: running with {}", kVersion, config->robot.id.value, file);
  Runtime runtime(std::move(*config), machine);
  Watchdog watchdog(runtime.heartbeats());
  for (const ConfigFault& doubt : checked.warnings)
    log_message(LogLevel::kWarning, to_string(doubt));
  log_message(LogLevel::kInfo, start);
  Watchdog::notify_ready();
  Timestamp next_check = machine.now() + kCheckPeriod;
  for (;;) {
    const Signal signal = signals.wait_for(next_check - machine.now());
    if (signal == Signal::kStop) break;
    if (signal == Signal::kReload) reload(file, runtime, *lock, machine);
    if (machine.now() < next_check) continue;  // reloads do not delay the watchdog
    for (const std::string& loop : watchdog.check())
      log_message(LogLevel::kError, loop + ": this loop makes no progress");
    next_check = machine.now() + kCheckPeriod;
  }
  log_message(LogLevel::kInfo, "stopped by a signal");
  Watchdog::notify_stopping();
  return kDone;
}

}  // namespace
}  // namespace crepes

// NOLINTNEXTLINE(bugprone-exception-escape): out of memory it aborts, and systemd starts it again
int main(int argc, char** argv) {
  CLI::App app{"Relative localization of a robot swarm", "crepesd"};
  std::string file = "/etc/crepes/crepesd.yaml";
  const auto add_file_option = [&](const std::string& name, const std::string& help) {
    return app.add_option(name, file, help)->expected(0, 1)->capture_default_str();
  };
  auto* run =
      add_file_option("--config", "run with this configuration; the default without any option");
  auto* check = add_file_option("--check-config",
                                "print every fault and warning of the configuration and exit")
                    ->excludes(run);
  auto* dump = add_file_option("--dump-config", "print the merged configuration and exit")
                   ->excludes(run)
                   ->excludes(check);
  bool strict = false;
  app.add_flag("--strict", strict, "warnings are faults")->needs(check);
  bool reference = false;
  app.add_flag("--write-reference", reference, "print a configuration with all keys and exit")
      ->excludes(run)
      ->excludes(check)
      ->excludes(dump);
  app.set_version_flag("--version", std::string(crepes::kVersion));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? crepes::kDone : crepes::kBadUsage;
  }
  if (reference) return crepes::print(crepes::reference_config());
  if (*dump) return crepes::print(crepes::load_config(file).map(crepes::write_config));
  return *check ? crepes::check(file, strict) : crepes::run(file);
}
