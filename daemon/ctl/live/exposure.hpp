/// crepesctl exposure: sets exposure and gain of a running camera, and shows how bright boards are.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>

#include "daemon/ctl/live/daemon_access.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Options of `crepesctl exposure`.
struct ExposureOptions {
  DaemonAddress daemon;
  std::filesystem::path config = "/etc/crepes/crepesd.yaml";  ///< of this daemon
  std::string camera;                                         ///< empty: the first
  std::optional<double> exposure_us;
  std::optional<double> gain;
  std::optional<pid_t> pid;  ///< of the daemon; if not given, systemd reloads the service
  bool json = false;
};

/// Writes what is given to the fragment 90-exposure.yaml beside the configuration and reloads the
/// daemon. Nothing changes if the result has faults. Then shows the cameras' light: at a terminal,
/// keys change it until q; else once.
[[nodiscard]] Result<void> exposure(const ExposureOptions& options);

}  // namespace crepes
