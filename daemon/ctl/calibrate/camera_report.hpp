/// What a camera calibration found, as text and JSON.
#pragma once

#include <array>
#include <filesystem>
#include <string>

#include "daemon/ctl/calibrate/calibration_report.hpp"
#include "estimator/calibration/camera/camera_batch.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// What was seen: so many boards, or LEDs of a grid.
struct SeenTarget {
  std::string words;  ///< for a reader
  std::string key;    ///< in JSON
  std::size_t count = 0;
};

/// Where the result goes, and how.
struct CameraOutput {
  std::filesystem::path out;
  std::array<int, 2> resolution{};
  bool kannala_brandt = false;
  bool json = false;
};

/// Unless the result is refused, writes `out`, a camchain-imucam.yaml of Kalibr. Fills in text and
/// reasons of `report`.
[[nodiscard]] Result<void> report_camera(const CameraBatchResult& found, const SeenTarget& target,
                                         const CameraOutput& output, CalibrationReport& report);

/// RMS residuals in hundredths of a pixel over the image, a dot where nothing was seen.
[[nodiscard]] std::string map_text(const ResidualMap& map);

}  // namespace crepes
