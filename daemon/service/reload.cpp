#include "daemon/service/reload.hpp"

#include <sstream>
#include <utility>

#include "config/reading/config_file.hpp"
#include "daemon/service/logging.hpp"
#include "daemon/service/watchdog.hpp"

namespace crepes {
namespace {

std::string joined(const std::vector<std::string>& keys) {
  std::string text;
  for (const std::string& key : keys) text += (text.empty() ? "" : ", ") + key;
  return text;
}

void refuse(const Error& error, Runtime& runtime) {
  std::istringstream faults(error.message);
  for (std::string fault; std::getline(faults, fault);) log_message(LogLevel::kError, fault);
  log_message(LogLevel::kError, "reload refused: the settings stay as they were");
  runtime.report_refused_reload(error.message);
}

/// The mesh that is wanted is claimed before, and the old one released after the change.
Result<ConfigChange> reconfigure(const CheckedConfig& checked, Runtime& runtime, RobotLock& lock) {
  if (!checked.faults.empty()) return fail(ErrorCode::kConfig, to_string(checked.faults));
  const Config& wanted = checked.config;
  auto moved = lock.moved_to(wanted.net.interface, wanted.net.port);
  if (!moved) return tl::unexpected(moved.error());
  auto change = runtime.reconfigure(wanted);
  if (change && *moved) lock = std::move(**moved);
  return change;
}

}  // namespace

void reload(const std::string& file, Runtime& runtime, RobotLock& lock, const Clock& machine) {
  Watchdog::notify_reloading(machine.now());
  const CheckedConfig checked = check_config(file);
  const auto change = reconfigure(checked, runtime, lock);
  if (!change) {
    refuse(change.error(), runtime);
  } else {
    set_log_level(change->config.log.level);
    for (const ConfigFault& doubt : checked.warnings)
      log_message(LogLevel::kWarning, to_string(doubt));
    log_message(LogLevel::kInfo, change->live.empty()
                                     ? "reloaded: nothing has changed that can change live"
                                     : "reloaded: " + joined(change->live));
    if (!change->restart.empty())
      log_message(LogLevel::kWarning, "restart to apply: " + joined(change->restart));
  }
  Watchdog::notify_ready();
}

}  // namespace crepes
