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

[[nodiscard]] Result<std::string> status(const StatusOptions& options);

/// Sensors, neighbors and why there is no pose, clocks, mesh, load.
[[nodiscard]] std::string status_text(const client::Status& status);

}  // namespace crepes
