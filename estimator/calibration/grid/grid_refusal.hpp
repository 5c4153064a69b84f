/// Whether pictures of a grid can calibrate a lens, and what they lack.
#pragma once

#include <vector>

#include "estimator/calibration/grid/grid_calibration.hpp"

namespace crepes {

/// Adds refusals and warnings about the pictures that do not show the grid, and if too few do.
void judge_views(const std::vector<GridPicture>& pictures, const GridSettings& settings,
                 GridCalibration& result);

/// The same, and about attitudes, sigmas, the rim and residuals.
void judge_grid(const GridFit& fit, const std::vector<GridPicture>& pictures,
                const GridSettings& settings, GridCalibration& result);

}  // namespace crepes
