/// crepesctl calibrate range: antenna delays from robots at rest at taped distances.
#pragma once

#include <filesystem>

#include "daemon/ctl/calibrate/calibration_report.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Options of `crepesctl calibrate range`.
struct CalibrateRangeOptions {
  std::filesystem::path swarm_dir;
  std::filesystem::path tape;
  std::filesystem::path out;
  bool json = false;
};

/// Writes FILE, the biases of pairs and modules. If the pairs determine the modules, or there are
/// two robots, it also writes FILE's name with .members.yaml: a fragment with
/// `swarm.members[].range_delay_m` for every robot.
[[nodiscard]] Result<CalibrationReport> calibrate_range(const CalibrateRangeOptions& options);

}  // namespace crepes
