/// crepesctl status: the state of a daemon on one screen.
#pragma once

#include <string>

#include "daemon/ctl/live/daemon_access.hpp"

namespace crepes {

/// Options of `crepesctl status`.
struct StatusOptions {
  DaemonAddress daemon;
  bool json = false;  ///< the daemon's own JSON, as one object
};

/// What a daemon has not taken over from its files; both are empty if nothing is amiss.
struct ConfigState {
  std::string fault;    ///< why the last reload was refused
  std::string restart;  ///< keys that wait for a restart
};

/// Of a STATUS in JSON.
[[nodiscard]] ConfigState config_state_of(const std::string& status_json);

[[nodiscard]] Result<std::string> status(const StatusOptions& options);

/// Configuration, sensors, neighbors and why there is no pose, clocks, mesh, load.
[[nodiscard]] std::string status_text(const client::Status& status, const ConfigState& config);

}  // namespace crepes
