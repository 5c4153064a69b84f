/// Whether a recording can calibrate a camera, and what it lacks.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "estimator/calibration/camera/camera_batch.hpp"

namespace crepes {

/// Too short, too few sightings, gaps in the IMU's samples.
[[nodiscard]] std::vector<std::string> refusals_before_fit(
    std::span<const ImuSample> imu, std::span<const BoardSighting> sightings);

/// The body's axes about which it hardly turned.
[[nodiscard]] std::vector<std::string> motion_refusals(const Eigen::Vector3d& rate_rms_radps);

/// Adds refusals (motion, sigmas, boards that moved) and warnings (quarters that were never seen,
/// residuals that grow to the rim).
void judge_camera(const CameraSolution& solution, std::span<const BoardSighting> sightings,
                  const std::vector<std::string>& names, const CameraBatchSettings& settings,
                  CameraBatchResult& result);

/// Adds a warning if seconds that were held out fit worse than the others.
void judge_held_out(CameraBatchResult& result);

}  // namespace crepes
