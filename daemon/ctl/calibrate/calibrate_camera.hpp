/// crepesctl calibrate camera: lens, mounting and time shift, with no target but other boards.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>

#include "daemon/ctl/calibrate/calibration_report.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Options of `crepesctl calibrate camera`.
struct CalibrateCameraOptions {
  std::filesystem::path robot_dir;
  std::filesystem::path out;
  std::optional<double> fov_deg;  ///< if given, crepesd.yaml's lens is not used as a guess
  bool kannala_brandt = false;    ///< write that model instead of Double Sphere
  bool force = false;             ///< replace whatever has the name of the result
  bool json = false;
  std::function<void(double)> on_progress;  ///< 0..1; optional
};

/// Writes FILE, a camchain-imucam.yaml of Kalibr.
[[nodiscard]] Result<CalibrationReport> calibrate_camera(const CalibrateCameraOptions& options);

}  // namespace crepes
