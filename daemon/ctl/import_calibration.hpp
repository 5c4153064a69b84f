/// crepesctl import-calibration: other programs' calibration files to ours.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "estimator/core/result.hpp"

namespace crepes {

/// The sections `cameras` and `imu`, as far as the files have them: Kalibr's camchain.yaml,
/// camchain-imucam.yaml and imu.yaml, and Basalt's calibration.json. All faults in one message, one
/// a line. In JSON, which a configuration may be written in, too, if `json`.
[[nodiscard]] Result<std::string> import_calibration(
    const std::vector<std::filesystem::path>& files, bool json = false);

}  // namespace crepes
