/// Solves the batch problem of a camera calibration.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "estimator/calibration/camera/camera_problem.hpp"
#include "estimator/calibration/camera/camera_state.hpp"

namespace crepes {

/// The state of least cost, with residuals and covariance.
struct CameraSolution {
  CameraState state;
  Eigen::MatrixXd covariance;  ///< of the constants, in the order of `camera_constants`
  std::vector<SightingResidual> residuals;
  double sigma_px = 0.0;  ///< of a spot's coordinate, from the residuals
  double outliers = 0.0;  ///< share of sightings of small weight
  bool has_converged = false;
};

/// Whether it is none, or further off than five sigma.
[[nodiscard]] inline bool is_outlier(const SightingResidual& residual, double sigma_px) {
  constexpr double kSigmas = 5.0;
  return !residual.is_valid ||
         residual.uv.squaredNorm() > 2.0 * kSigmas * kSigmas * sigma_px * sigma_px;
}

/// 0 to 1.
using Progress = std::function<void(double)>;

/// Levenberg-Marquardt, from loose to tight: a spot's sigma is 10 px, then 2 px, then what the
/// residuals say, in which outliers weigh less and less (graduated non-convexity, Yang et al.
/// 2020).
[[nodiscard]] CameraSolution solve_camera(CameraProblem& problem, const CameraState& start,
                                          const Progress& progress);

/// Again from a solution, without the sightings of weight 0 in `mask`. The residuals are those of
/// all.
[[nodiscard]] CameraSolution resolve_camera(CameraProblem& problem, const CameraState& prior,
                                            const CameraSolution& solution,
                                            const std::vector<double>& mask);

}  // namespace crepes
