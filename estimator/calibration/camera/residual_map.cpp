#include "estimator/calibration/camera/residual_map.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/calibration/camera/camera_solver.hpp"

namespace crepes {

double ResidualMap::Cell::rms_px() const {
  return count == 0 ? 0.0 : std::sqrt(square_px2 / (2.0 * static_cast<double>(count)));
}

double image_circle_px(std::span<const BoardSighting> sightings, const Eigen::Vector2d& center,
                       int width, int height) {
  const double nearer = 0.5 * std::min(width, height);
  if (sightings.empty()) return nearer;
  std::vector<double> radii;
  for (const BoardSighting& sighting : sightings) radii.push_back((sighting.uv - center).norm());
  const auto rim = radii.begin() + static_cast<std::ptrdiff_t>(99 * (radii.size() - 1) / 100);
  std::ranges::nth_element(radii, rim);
  return std::max(nearer, *rim);
}

ResidualMap map_of(std::span<const BoardSighting> sightings,
                   std::span<const SightingResidual> residuals, double sigma_px, int width,
                   int height) {
  ResidualMap map;
  const auto index = [](double x, int size, int cells) {
    return std::clamp(static_cast<int>((x + 0.5) / size * cells), 0, cells - 1);
  };
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    if (is_outlier(residuals[i], sigma_px)) continue;
    const int column = index(sightings[i].uv.x(), width, ResidualMap::kColumns);
    const int row = index(sightings[i].uv.y(), height, ResidualMap::kRows);
    ResidualMap::Cell& cell =
        map.cells[static_cast<std::size_t>(row * ResidualMap::kColumns + column)];
    ++cell.count;
    cell.square_px2 += residuals[i].uv.squaredNorm();
  }
  return map;
}

}  // namespace crepes
