/// crepesctl calibrate imu: accelerometer and gyroscope of a recording, as keys of crepesd.yaml.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "daemon/ctl/calibrate/calibration_report.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Options of `crepesctl calibrate imu`.
struct CalibrateImuOptions {
  std::filesystem::path robot_dir;
  std::filesystem::path out;
  double gravity_mps2 = kNominalGravityMps2;
  bool rest = false;   ///< the recording is of an hour at rest: noise alone
  bool force = false;  ///< replace whatever has the name of the result
  bool json = false;
  std::function<void(double)> on_progress{};  ///< 0..1; optional
};

/// Writes FILE, a fragment with the section `imu`, and FILE's name with .kalibr.yaml, which is
/// Kalibr's imu.yaml.
[[nodiscard]] Result<CalibrationReport> calibrate_imu(const CalibrateImuOptions& options);

}  // namespace crepes
