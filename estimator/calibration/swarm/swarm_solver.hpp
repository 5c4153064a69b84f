/// Solves the batch problem of a swarm's calibration.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "estimator/calibration/camera/camera_solver.hpp"
#include "estimator/calibration/swarm/swarm_problem.hpp"
#include "estimator/calibration/swarm/swarm_state.hpp"

namespace crepes {

/// The state of least cost, with residuals and covariance.
struct SwarmSolution {
  SwarmState state;
  Eigen::MatrixXd covariance;  ///< of the constants, robot by robot; empty if they are singular
  SwarmResiduals residuals;
  std::vector<double> sigma_px;  ///< of a spot's coordinate, by observer, from the residuals
  std::vector<double> outliers;  ///< share of sightings of small weight, by observer
  double sigma_m = 0.0;          ///< of a range
  double range_outliers = 0.0;   ///< share
  bool has_converged = false;
};

/// As `solve_camera`: from loose to tight, outliers weighed down more and more.
[[nodiscard]] SwarmSolution solve_swarm(SwarmProblem& problem, const SwarmState& start,
                                        const Progress& progress);

}  // namespace crepes
