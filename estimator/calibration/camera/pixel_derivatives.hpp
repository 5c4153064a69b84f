/// How pixels all over a picture move with the numbers of a lens.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

namespace crepes {

/// 200 points that are spread evenly over a circle of the picture.
[[nodiscard]] std::vector<Eigen::Vector2d> points_of_circle(const Eigen::Vector2d& center,
                                                            double radius_px);

/// A pixel after `step` was added to number `i`; empty where the lens shows nothing.
using PixelAt = std::function<std::optional<Eigen::Vector2d>(Eigen::Index i, double step)>;

/// A column for each of the numbers, by central differences. Empty where the lens shows nothing.
[[nodiscard]] std::optional<Eigen::Matrix2Xd> pixel_derivatives(Eigen::Index numbers, double step,
                                                                const PixelAt& pixel_at);

}  // namespace crepes
