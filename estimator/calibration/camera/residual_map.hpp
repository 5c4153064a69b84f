/// Residuals over the image: where light fell, and how well the lens explains it there.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>

#include "estimator/calibration/camera/camera_problem.hpp"

namespace crepes {

/// Cells of equal size, row by row from the top left.
struct ResidualMap {
  static constexpr int kColumns = 10;
  static constexpr int kRows = 8;
  /// The residuals in one cell of the picture.
  struct Cell {
    std::size_t count = 0;
    double square_px2 = 0.0;  ///< sum of squared lengths

    /// Of a coordinate [px]; zero for an empty cell.
    [[nodiscard]] double rms_px() const;
  };
  std::array<Cell, static_cast<std::size_t>(kColumns) * kRows> cells{};

  [[nodiscard]] const Cell& at(int row, int column) const {
    return cells[static_cast<std::size_t>(row) * kColumns + static_cast<std::size_t>(column)];
  }
};

/// The radius of the part of the picture that the lens shows [px]: to the nearer border, or as far
/// as spots were seen, all but one in a hundred.
[[nodiscard]] double image_circle_px(std::span<const BoardSighting> sightings,
                                     const Eigen::Vector2d& center, int width, int height);

/// Outliers are not counted.
[[nodiscard]] ResidualMap map_of(std::span<const BoardSighting> sightings,
                                 std::span<const SightingResidual> residuals, double sigma_px,
                                 int width, int height);

}  // namespace crepes
