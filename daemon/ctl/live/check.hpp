/// crepesctl check: a running robot, from its sensors to its calibration, and what to do.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "daemon/ctl/live/daemon_access.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Options of `crepesctl check`.
struct CheckOptions {
  DaemonAddress daemon;
  std::filesystem::path config;  ///< the daemon's configuration, for its rates; may be empty
  double duration_s = 3.0;       ///< to watch
  std::string led_port{};        ///< of the own board; empty: it is not asked
  std::string walk{};            ///< name or id of the neighbor to carry around; empty: nobody
  std::optional<double> distance_m{};  ///< by tape, to that neighbor
  bool json = false;
};

/// The findings as text, and whether one is a fault.
struct CheckReport {
  std::string text;
  bool is_good = false;  ///< no fault was found; doubts do not count
};

[[nodiscard]] Result<CheckReport> check(const CheckOptions& options);

}  // namespace crepes
