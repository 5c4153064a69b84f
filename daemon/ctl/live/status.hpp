/// crepesctl status: the state of a daemon on one screen.
#pragma once

#include <string>

#include "net/client/daemon_client.hpp"

namespace crepes {

struct StatusOptions {
  DaemonAddress daemon;
  bool json = false;  ///< the daemon's own JSON, as one object
};

[[nodiscard]] Result<std::string> status(const StatusOptions& options);

/// Sensors, neighbors and why there is no pose, clocks, mesh, load.
[[nodiscard]] std::string status_text(const StatusMessage& status);

}  // namespace crepes
