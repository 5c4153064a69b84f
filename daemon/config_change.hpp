/// What a reload may change while the daemon runs, and what has to wait.
#pragma once

#include <string>
#include <vector>

#include "estimator/core/config.hpp"

namespace crepes {

/// A wanted configuration against the running one. Keys are dotted paths in the order of the
/// schema; a list is one key.
struct ConfigChange {
  Config config;                     ///< the running one with what can change live as wanted
  std::vector<std::string> live;     ///< what changes now
  std::vector<std::string> restart;  ///< what stays as it is until the daemon starts again
};

/// By the marks in `Config::visit`. The result may break rules that the wanted one keeps (robot.id
/// stays): see `validate`.
[[nodiscard]] ConfigChange live_change(const Config& running, const Config& wanted);

}  // namespace crepes
