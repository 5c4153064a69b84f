/// The daemon: options, configuration, Runtime, wait.
#include <CLI/CLI.hpp>
#include <iostream>
#include <string>
#include <utility>

#include "daemon/config_file.hpp"
#include "daemon/logging.hpp"
#include "daemon/runtime.hpp"
#include "daemon/stop_signals.hpp"
#include "daemon/version.hpp"
#include "daemon/watchdog.hpp"
#include "drivers/monotonic_clock.hpp"

namespace crepes {
namespace {

constexpr int kDone = 0;
constexpr int kBadInput = 1;
constexpr int kBadUsage = 2;

int check(const std::string& file) {
  const auto faults = check_config(file).faults;
  for (const ConfigFault& fault : faults) std::cerr << to_string(fault) << '\n';
  if (!faults.empty()) return kBadInput;
  std::cout << file << ": good\n";
  return kDone;
}

int run(const std::string& file) {
  Result<Config> config = load_config(file);
  if (!config) {
    std::cerr << config.error().message << '\n';
    return kBadInput;
  }
  const StopSignals signals;
  const LogSession log(config->log.level);
  const MonotonicClock machine;
  const Runtime runtime(std::move(*config), machine);
  Watchdog watchdog(runtime.heartbeats());
  log_message(LogLevel::kInfo, "running with " + file);
  Watchdog::tell_ready();
  Watchdog::tell_status("running with " + file +
                        "; `crepesctl status` tells sensors and neighbors");
  while (!signals.came_within_a_second()) {
    for (const std::string& loop : watchdog.check())
      log_message(LogLevel::kError, loop + ": this loop makes no progress");
  }
  Watchdog::tell_stopping();
  return kDone;
}

}  // namespace
}  // namespace crepes

int main(int argc, char** argv) {
  CLI::App app{"Relative localization of a robot swarm", "crepesd"};
  std::string config;
  std::string checked;
  app.set_version_flag("--version", std::string(crepes::kVersion));
  app.add_option("--config", config, "run with this configuration");
  app.add_option("--check-config", checked, "print every fault of a configuration and exit");
  bool reference = false;
  app.add_flag("--write-reference", reference, "print a configuration with all keys and exit");
  app.require_option(1);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? crepes::kDone : crepes::kBadUsage;
  }
  if (reference) {
    std::cout << crepes::reference_config();
    return crepes::kDone;
  }
  return checked.empty() ? crepes::run(config) : crepes::check(checked);
}
