/// crepesctl calibrate range: antenna delays from robots at rest at taped distances.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "daemon/ctl/calibrate/calibration_report.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Options of `crepesctl calibrate range`.
struct CalibrateRangeOptions {
  std::filesystem::path swarm_dir;
  std::filesystem::path tape{};          ///< empty: `distances` alone
  std::vector<std::string> distances{};  ///< "r1,r2=5.00": at rest during the whole recording
  std::filesystem::path out;
  bool force = false;  ///< replace whatever has the name of the result
  bool json = false;
  std::function<void(double)> on_progress{};  ///< 0..1; optional
};

/// Writes FILE, the biases of pairs and modules, and FILE's name with .members.yaml: a fragment for
/// every robot with the errors that are left, and, where the pairs determine the modules or there
/// are two robots, `swarm.members[].range_delay_m`.
[[nodiscard]] Result<CalibrationReport> calibrate_range(const CalibrateRangeOptions& options);

}  // namespace crepes
