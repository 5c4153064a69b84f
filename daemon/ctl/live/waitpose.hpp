/// crepesctl waitpose: waits for a neighbor's pose, for scripts.
#pragma once

#include <optional>
#include <string>

#include "daemon/ctl/live/daemon_access.hpp"

namespace crepes {

/// Options of `crepesctl waitpose`.
struct WaitposeOptions {
  DaemonAddress daemon;
  std::string peer;  ///< its name or id
  double timeout_s = 10.0;
  std::optional<double> max_sigma_m;  ///< the largest acceptable sigma of the position
  bool json = false;
};

/// The pose on one line. If there is none in time, the error gives the reason. The daemon may start
/// during the wait.
[[nodiscard]] Result<std::string> wait_for_pose(const WaitposeOptions& options);

}  // namespace crepes
