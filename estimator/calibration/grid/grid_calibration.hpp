/// A lens from pictures of a flat grid of LEDs: no IMU, no other robot.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "estimator/calibration/camera/camera_solver.hpp"
#include "estimator/calibration/camera/residual_map.hpp"
#include "estimator/calibration/grid/grid_fit.hpp"

namespace crepes {

/// The lights of one picture, brightest first.
struct GridPicture {
  std::string name;
  std::vector<Eigen::Vector2d> lights;
};

/// What is known before.
struct GridSettings {
  GridShape shape;
  std::array<int, 2> resolution{};
  LensKind kind = LensKind::kDoubleSphere;
  double fov_rad = 0.0;  ///< roughly
  Progress on_progress;  ///< optional
};

/// The lens, how good it is, and what speaks against it.
struct GridCalibration {
  GridLens lens;
  Eigen::VectorXd sigma;       ///< of its numbers
  Eigen::MatrixXd covariance;  ///< of its numbers; empty if nothing was found
  double lens_sigma_px = 0.0;  ///< RMS over the part that was seen, after the best small rotation
  double spot_sigma_px = 0.0;  ///< of a coordinate, from the median of the residuals
  double rms_px = 0.0;         ///< of a coordinate, outliers left out
  double held_out_px = 0.0;    ///< the same in views that did not enter the fit
  double outliers = 0.0;       ///< share of the LEDs
  double seen_rad = 0.0;       ///< largest angle to the optical axis
  double seen_px = 0.0;        ///< largest distance from the center
  double tilt_rad =
      0.0;  ///< third largest angle between a view's line of sight and the grid's normal
  std::vector<std::size_t> views;  ///< numbers of the pictures that show the grid
  std::vector<GridView> poses;     ///< where it is in each of them
  ResidualMap map;
  std::vector<std::string> refusals;
  std::vector<std::string> warnings;
};

/// Starts from the resolution and the field of view alone. Unknown are the lens and the grid's pose
/// in each picture.
[[nodiscard]] GridCalibration calibrate_grid(const std::vector<GridPicture>& pictures,
                                             const GridSettings& settings);

}  // namespace crepes
