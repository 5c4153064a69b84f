/// crepesctl status: one look at a daemon, on one screen.
#pragma once

#include <string>

#include "daemon/ctl/daemon_client.hpp"

namespace crepes {

struct StatusOptions {
  DaemonAddress daemon;
  bool json = false;  ///< the daemon's own words, in one object
};

[[nodiscard]] Result<std::string> status(const StatusOptions& options);

/// Sensors, neighbors and why there is no pose, clocks, mesh, load.
[[nodiscard]] std::string status_text(const StatusMessage& status);

}  // namespace crepes
