/// crepesctl check: a running robot, from its sensors to its calibration, and what to do.
#pragma once

#include <filesystem>
#include <string>

#include "daemon/ctl/live/daemon_access.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Options of `crepesctl check`.
struct CheckOptions {
  DaemonAddress daemon;
  std::filesystem::path config;  ///< the daemon's configuration, for its rates; may be empty
  double duration_s = 3.0;       ///< to watch
  bool json = false;
};

/// The findings as text, and whether one is a fault.
struct CheckReport {
  std::string text;
  bool is_good = false;  ///< no fault was found; doubts do not count
};

[[nodiscard]] Result<CheckReport> check(const CheckOptions& options);

}  // namespace crepes
