/// crepesctl calibrate swarm: everything at once, from robots that fly in view of each other.
#pragma once

#include <filesystem>
#include <functional>

#include "daemon/ctl/calibrate/calibration_report.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Options of `crepesctl calibrate swarm`.
struct CalibrateSwarmOptions {
  std::filesystem::path swarm_dir;
  std::filesystem::path out;
  bool force = false;  ///< replace whatever has the name of the result
  bool json = false;
  std::function<void(double)> on_progress;  ///< 0..1; optional
};

/// Writes OUT/<robot>.yaml: camera as a camchain of Kalibr, IMU, biases of ranges and lever arms.
/// Beside it, OUT/<robot>.fragment.yaml for crepesd.d/ of that robot.
[[nodiscard]] Result<CalibrationReport> calibrate_swarm(const CalibrateSwarmOptions& options);

}  // namespace crepes
