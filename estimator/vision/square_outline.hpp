/// The outline of a square board whose LEDs touch along some edges.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>

#include "estimator/vision/ring_model.hpp"

namespace crepes {

/// A parallelogram, which is what a square is from afar: two pairs of parallel edges, on which
/// | normal . uv - middle | = half  for one pair, and not more for the other.
struct SquareOutline {
  /// Two edges that are parallel.
  struct Edges {
    Eigen::Vector2d normal = Eigen::Vector2d::UnitX();  ///< of length 1
    double middle = 0.0;                                ///< [px]
    double half = 0.0;                                  ///< [px]

    /// Signed distance from the line halfway between them [px].
    [[nodiscard]] double from_middle(const Eigen::Vector2d& uv) const {
      return normal.dot(uv) - middle;
    }
    [[nodiscard]] bool operator==(const Edges&) const = default;
  };
  std::array<Edges, 2> pairs;

  /// Distance from the nearest edge [px].
  [[nodiscard]] double distance_from(const Eigen::Vector2d& uv) const;
  /// As the view of a square with half edges of 1.
  [[nodiscard]] RingView view() const;
  [[nodiscard]] bool operator==(const SquareOutline&) const = default;
};

/// The parallelogram nearest to the points, which may be unevenly dense along it. `first` is a view
/// of a circle that is about as large, as `fit_ellipse` gives it. Nothing where an edge has none.
[[nodiscard]] std::optional<SquareOutline> fit_square(std::span<const Eigen::Vector2d> points,
                                                      const RingView& first);

/// How much of the outline is near one of the points, 0 to 1.
[[nodiscard]] double share_covered(const SquareOutline& outline,
                                   std::span<const Eigen::Vector2d> points);

}  // namespace crepes
