/// A camera's lens, mounting and time shift from a film of a grid of LEDs and the body's own IMU.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "estimator/calibration/camera/camera_batch.hpp"
#include "estimator/calibration/grid/grid_order.hpp"
#include "estimator/core/measurements.hpp"

namespace crepes {

/// The lights of one picture of a film, brightest first.
struct GridFrame {
  Timestamp stamp{};  ///< the camera's
  std::vector<Eigen::Vector2d> lights;
};

/// The batch problem of `calibrate_camera`, in which the boards are the LEDs of a rigid grid.
/// `settings.lens` is that of `calibrate_grid`, and good enough to order the LEDs. A picture counts
/// only if it shows all four borders of the grid: which LED is which is then certain but for the
/// grid's symmetry, and the gyroscope decides about that. `frames` are ordered by stamp.
[[nodiscard]] CameraBatchResult calibrate_grid_camera(std::span<const ImuSample> imu,
                                                      const std::vector<GridFrame>& frames,
                                                      const GridShape& shape,
                                                      const CameraBatchSettings& settings);

}  // namespace crepes
