/// What a calibration with a grid found, as text and JSON.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "estimator/calibration/grid/grid_calibration.hpp"

namespace crepes {

[[nodiscard]] std::string grid_text(const GridCalibration& found, std::size_t pictures,
                                    const std::filesystem::path& out);
[[nodiscard]] std::string grid_json(const GridCalibration& found,
                                    const std::vector<GridPicture>& pictures);

}  // namespace crepes
