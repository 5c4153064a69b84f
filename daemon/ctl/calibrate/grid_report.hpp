/// What a calibration with a grid found, as text and JSON.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "estimator/calibration/grid/grid_calibration.hpp"

namespace crepes {

/// The lens, its residuals and warnings, for a terminal.
[[nodiscard]] std::string grid_text(const GridCalibration& found, std::size_t pictures,
                                    const std::filesystem::path& out);
/// The same, and which pictures show no grid, as one JSON line.
[[nodiscard]] std::string grid_json(const GridCalibration& found,
                                    const std::vector<GridPicture>& pictures);

}  // namespace crepes
