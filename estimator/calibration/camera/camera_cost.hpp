/// What a camera calibration's state costs, and the residuals of its sightings.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "estimator/calibration/batch/arrow_system.hpp"
#include "estimator/calibration/camera/camera_problem.hpp"

namespace crepes {

/// Sums half the squares of all residuals that `CameraProblem` shows it, in sigmas.
class CameraCost {
 public:
  /// From a knot to the next, whitened.
  void imu(std::size_t /*knot*/, const ArrowSystem::StateVector& r) {
    sum_ += 0.5 * r.squaredNorm();
  }
  /// Of a board's spot.
  void sighting(std::size_t /*knot*/, std::size_t /*index*/, std::size_t /*board*/,
                const Eigen::Vector2d& r, double weight) {
    sum_ += 0.5 * weight * r.squaredNorm();
  }
  /// A sighting that the lens cannot show.
  void invalid(double cost) { sum_ += cost; }
  /// A prior of a constant: its residual, and the derivative.
  void prior_of_constant(int /*index*/, double r, double /*slope*/) { sum_ += 0.5 * r * r; }
  /// A prior of the first knot.
  void prior_of_first(const Eigen::Matrix<double, 1, ArrowSystem::kState>& /*row*/, double r) {
    sum_ += 0.5 * r * r;
  }

  [[nodiscard]] double sum() const { return sum_; }

 private:
  double sum_ = 0.0;
};

/// Collects the residuals of sightings in pixels, those of weight zero too.
class CameraResiduals {
 public:
  /// `residuals`, one a sighting, outlives it.
  CameraResiduals(std::vector<SightingResidual>& residuals, double sigma_px)
      : residuals_(residuals), sigma_px_(sigma_px) {}

  /// Is none of a sighting.
  void imu(std::size_t /*knot*/, const ArrowSystem::StateVector& /*r*/) {}
  /// Of a board's spot, in sigmas.
  void sighting(std::size_t /*knot*/, std::size_t index, std::size_t /*board*/,
                const Eigen::Vector2d& r, double /*weight*/) {
    residuals_[index] = {r * sigma_px_, true};
  }
  /// Keeps what the collection began with.
  void invalid(double /*cost*/) {}

 private:
  std::vector<SightingResidual>& residuals_;
  double sigma_px_;
};

}  // namespace crepes
