/// What a reload changes while the daemon runs, and what waits for a restart.
#pragma once

#include <string>
#include <vector>

#include "config/schema/config.hpp"

namespace crepes {

/// The difference between a wanted configuration and the running one. Keys are dotted paths in the
/// order of the schema; a list is one key.
struct ConfigChange {
  Config config;                     ///< the running one with all live settings as wanted
  std::vector<std::string> live;     ///< keys that change now
  std::vector<std::string> restart;  ///< keys that change when the daemon starts again
};

/// Uses the marks in `Config::visit`. The result may break a rule that the wanted configuration
/// keeps, because restart settings stay: call `validate`.
[[nodiscard]] ConfigChange plan_reload(const Config& running, const Config& wanted);

}  // namespace crepes
