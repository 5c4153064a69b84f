/// Cameras, lever arms, antenna delays and IMUs of a whole swarm, from a flight in view of each
/// other.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "estimator/calibration/camera/camera_solver.hpp"
#include "estimator/calibration/swarm/swarm_problem.hpp"
#include "estimator/calibration/swarm/swarm_start.hpp"
#include "estimator/calibration/swarm/swarm_state.hpp"

namespace crepes {

/// Names for the messages, and a function that receives the progress.
struct SwarmBatchSettings {
  std::vector<std::string> names;  ///< of the robots, for messages
  Progress on_progress;            ///< optional
};

/// Of one robot.
struct CalibratedRobot {
  RobotConstants before;
  RobotConstants after;
  RobotPriors prior_sigma = RobotPriors::Zero();  ///< in the order of `swarm_constants`
  RobotPriors sigma = RobotPriors::Zero();
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();  ///< mean over the recording
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();
  double spot_before_px = 0.0;  ///< RMS of a coordinate at the start, outliers left out
  double spot_sigma_px = 0.0;   ///< one sigma of a coordinate in the end
  double outliers = 0.0;        ///< share of its sightings
  std::size_t sightings = 0;

  /// Whether the recording says more about a constant than the prior did: a quarter of the sigma is
  /// gone.
  [[nodiscard]] bool is_determined(int constant) const {
    constexpr double kDetermined = 0.75;
    return sigma(constant) < kDetermined * prior_sigma(constant);
  }
};

/// The calibrations of all robots, their quality, and the reasons to refuse them.
struct SwarmBatchResult {
  std::vector<CalibratedRobot> robots;
  Eigen::MatrixXd covariance;       ///< of all constants, robot by robot, then of the pairs' biases
  std::vector<double> pair_bias_m;  ///< by `pair_index`; what antenna delays do not explain
  double range_sigma_m = 0.0;       ///< of a single range, from the residuals
  double range_outliers = 0.0;
  double seconds = 0.0;  ///< of the recording that were used
  std::vector<std::string> refusals;
  std::vector<std::string> warnings;
};

/// One sigma of what two modules' delays together lengthen their ranges by.
[[nodiscard]] double pair_delay_sigma(const SwarmBatchResult& result, std::size_t a, std::size_t b);

/// What a robot's ranges are still off by once the delays are in force, one sigma: that of its
/// worst pair, with the pair's own bias, and at least what directions of arrival change [m].
[[nodiscard]] double remaining_range_bias(const SwarmBatchResult& result, std::size_t robot);

/// `guess`: the configuration in force, by robot. See `SwarmProblem` for what is unknown.
[[nodiscard]] SwarmBatchResult calibrate_swarm(std::vector<RobotRecord> records,
                                               const std::vector<RobotConstants>& guess,
                                               const SwarmStart& start,
                                               const SwarmBatchSettings& settings);

}  // namespace crepes
