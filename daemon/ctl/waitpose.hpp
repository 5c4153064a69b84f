/// crepesctl waitpose: for scripts that go on once a neighbor's pose is there.
#pragma once

#include <optional>
#include <string>

#include "daemon/ctl/daemon_client.hpp"

namespace crepes {

struct WaitposeOptions {
  DaemonAddress daemon;
  RobotId peer{};
  double timeout_s = 10.0;
  std::optional<double> max_sigma_m;  ///< how well its position must be known, one sigma
  bool json = false;
};

/// The pose, in a line; an error says why there was none in time. The daemon may start meanwhile.
[[nodiscard]] Result<std::string> wait_for_pose(const WaitposeOptions& options);

}  // namespace crepes
