/// Which light of a picture is which LED of a flat grid.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "estimator/calibration/grid/grid_lens.hpp"

namespace crepes {

/// LEDs in rows and columns, the same pitch along both.
struct GridShape {
  int rows = 0;
  int columns = 0;
  double pitch_m = 0.0;

  [[nodiscard]] int leds() const { return rows * columns; }
};

/// An LED of the grid, and where it is seen. Which corner is the first is any of those that the
/// grid's symmetry leaves open; and if a border of the grid is hidden, any that its size leaves
/// open.
struct GridLed {
  int row = 0;
  int column = 0;
  Eigen::Vector2d uv = Eigen::Vector2d::Zero();
};

/// The grid among lights of a picture, brightest first: neighbors are searched where those that
/// are already found continue, on the sphere of directions that `lens`, roughly, sees. LEDs may be
/// missing and other lights be there. Empty unless half of the LEDs are found.
[[nodiscard]] std::vector<GridLed> find_grid(std::span<const Eigen::Vector2d> lights,
                                             const GridLens& lens, const GridShape& shape);

}  // namespace crepes
