/// The recording of `crepesctl calibrate camera --live`.
#pragma once

#include <filesystem>

#include "estimator/core/result.hpp"

namespace crepes {

/// Options of the recording.
struct RecordForCameraOptions {
  std::filesystem::path dir;     ///< a new data set
  std::filesystem::path socket;  ///< of the daemon's recordings
  bool is_quiet = false;         ///< shows nothing on standard output
};

/// Records a running daemon until its camera has seen enough for a calibration, q, or a signal.
/// Shows meanwhile where in the picture boards were seen and which turns are missing, and beeps at
/// the end. Returns the robot's folder.
[[nodiscard]] Result<std::filesystem::path> record_for_camera(
    const RecordForCameraOptions& options);

}  // namespace crepes
