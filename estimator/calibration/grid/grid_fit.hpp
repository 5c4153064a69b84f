/// A lens and the poses of a grid from where its LEDs are seen.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "estimator/calibration/camera/camera_problem.hpp"
#include "estimator/calibration/grid/grid_lens.hpp"
#include "estimator/calibration/grid/grid_order.hpp"
#include "estimator/core/pose.hpp"

namespace crepes {

/// The grid in one picture. G: x along the rows, y along the columns, z away from the camera; the
/// origin is the first LED.
struct GridView {
  std::vector<GridLed> leds;
  Pose T_C_G;
};

/// The pose of least algebraic error of bearings (DLT). Empty with fewer than four LEDs, or if
/// they do not determine it.
[[nodiscard]] std::optional<Pose> grid_pose(const std::vector<GridLed>& leds, const GridLens& lens,
                                            const GridShape& shape);

/// A fitted lens, and where the grid is in each view.
struct GridFit {
  GridLens lens;
  std::vector<GridView> views;
  std::vector<SightingResidual> residuals;  ///< LED by LED, view by view
  Eigen::MatrixXd covariance;               ///< of the lens's numbers; empty if not determined
  double sigma_px = 0.0;                    ///< of a coordinate, from the median
  double outliers = 0.0;                    ///< share of the LEDs
  bool has_converged = false;
};

/// What a fit searches.
enum class GridUnknowns : std::uint8_t { kLensAndPoses, kPoses };

/// Levenberg-Marquardt from loose to tight, as `solve_camera`. `views` hold the first poses.
[[nodiscard]] GridFit fit_grid(const GridLens& lens, std::vector<GridView> views,
                               const GridShape& shape, GridUnknowns unknowns);

/// Only so far as shows whether the start is a good one: half as many iterations, nothing weighed
/// down.
[[nodiscard]] GridFit try_grid(const GridLens& lens, std::vector<GridView> views,
                               const GridShape& shape);

}  // namespace crepes
