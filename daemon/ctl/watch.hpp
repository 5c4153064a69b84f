/// crepesctl watch: what a running daemon says, as it says it.
#pragma once

#include <optional>

#include "daemon/ctl/daemon_client.hpp"

namespace crepes {

struct WatchOptions {
  DaemonAddress daemon;
  std::optional<double> for_s;  ///< stop after so long; else when told to
  bool once = false;            ///< one table, then stop
  bool json = false;            ///< the daemon's objects as they come, one a line
};

/// Shows poses until it is stopped. A daemon that never answers is an error.
[[nodiscard]] Result<void> watch(const WatchOptions& options);

}  // namespace crepes
