#include "estimator/calibration/camera/pixel_derivatives.hpp"

#include <cmath>

namespace crepes {

std::vector<Eigen::Vector2d> points_of_circle(const Eigen::Vector2d& center, double radius_px) {
  constexpr int kPoints = 200;
  constexpr double kGoldenAngle = 2.399963229728653;
  std::vector<Eigen::Vector2d> points;
  for (int k = 0; k < kPoints; ++k) {
    const double radius = radius_px * std::sqrt((k + 0.5) / kPoints);
    points.emplace_back(
        center + radius * Eigen::Vector2d(std::cos(k * kGoldenAngle), std::sin(k * kGoldenAngle)));
  }
  return points;
}

std::optional<Eigen::Matrix2Xd> pixel_derivatives(Eigen::Index numbers, double step,
                                                  const PixelAt& pixel_at) {
  Eigen::Matrix2Xd derivatives(2, numbers);
  for (Eigen::Index i = 0; i < numbers; ++i) {
    const auto above = pixel_at(i, step);
    const auto below = pixel_at(i, -step);
    if (!above || !below) return std::nullopt;
    derivatives.col(i) = (*above - *below) / (2.0 * step);
  }
  return derivatives;
}

}  // namespace crepes
