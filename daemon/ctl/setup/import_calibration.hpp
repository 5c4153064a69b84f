/// crepesctl import-calibration: converts calibration files of other programs.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "estimator/core/result.hpp"

namespace crepes {

/// The sections `cameras` and `imu`, as far as the files have them: Kalibr's camchain.yaml,
/// camchain-imucam.yaml and imu.yaml, and Basalt's calibration.json. All faults are in one message,
/// one a line. The result is YAML or, with `json`, JSON; a configuration may be written in either.
[[nodiscard]] Result<std::string> import_calibration(
    const std::vector<std::filesystem::path>& files, bool json = false);

}  // namespace crepes
