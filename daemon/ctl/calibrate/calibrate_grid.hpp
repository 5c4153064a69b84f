/// crepesctl calibrate camera --grid: a lens from pictures of a flat grid of LEDs, and with an IMU
/// the mounting and the time shift, too.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "daemon/ctl/calibrate/calibration_report.hpp"
#include "estimator/calibration/grid/grid_order.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Options of `crepesctl calibrate camera --grid`.
struct CalibrateGridOptions {
  std::filesystem::path pictures;  ///< a folder of pictures, or a robot's folder of a recording
  std::filesystem::path out;
  GridShape grid;
  std::optional<double> fov_deg;
  bool kannala_brandt = false;
  bool force = false;  ///< replace whatever has the name of the result
  bool json = false;
  std::function<void(double)> on_progress;  ///< 0..1; optional
};

/// "5x7".
[[nodiscard]] Result<GridShape> parse_grid(const std::string& text, double pitch_m);

/// Writes a camchain.yaml of Kalibr. If `pictures` is a robot's folder with inertial samples, its
/// film also says how the camera is mounted, and its time shift; pictures alone do not, and
/// T_cam_imu is left out.
[[nodiscard]] Result<CalibrationReport> calibrate_grid(const CalibrateGridOptions& options);

}  // namespace crepes
