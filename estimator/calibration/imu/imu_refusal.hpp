/// Whether a recording can calibrate an IMU, and what it lacks.
#pragma once

#include <string>
#include <vector>

#include "estimator/calibration/imu/imu_calibration.hpp"

namespace crepes {

/// Directions of gravity that differ by more than 15 degrees from all others counted.
[[nodiscard]] int count_attitudes(const std::vector<Rest>& rests);

/// What the rests alone say: too few attitudes, trembling hands, no rest at all.
[[nodiscard]] std::vector<std::string> refusals_before_fit(const ImuCalibration& found);

/// Adds refusals and warnings for what the fit says: sigmas too large, residuals too large.
void judge_fit(const ImuCalibrationSettings& settings, ImuCalibration& found);

}  // namespace crepes
