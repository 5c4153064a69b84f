/// crepesctl watch: the messages of a running daemon as they arrive.
#pragma once

#include <optional>

#include "daemon/ctl/live/daemon_access.hpp"

namespace crepes {

/// Options of `crepesctl watch`.
struct WatchOptions {
  DaemonAddress daemon;
  std::optional<double> for_s;  ///< stop after this time; otherwise on a signal or key
  bool once = false;            ///< one table or its messages, then stop
  bool json = false;            ///< the daemon's objects as they arrive, one a line
};

/// Shows poses until it is stopped. A daemon that never answers is an error.
[[nodiscard]] Result<void> watch(const WatchOptions& options);

}  // namespace crepes
