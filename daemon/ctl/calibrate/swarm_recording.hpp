/// A recorded swarm as the calibration of a swarm needs it: on one clock, boards identified, and
/// with a first guess of who was where.
#pragma once

#include <functional>
#include <vector>

#include "daemon/ctl/dataset/swarm_dataset.hpp"
#include "estimator/calibration/swarm/swarm_problem.hpp"
#include "estimator/calibration/swarm/swarm_start.hpp"
#include "estimator/calibration/swarm/swarm_state.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Robots in the order of the data set.
struct SwarmMeasurements {
  std::vector<RobotRecord> records;
  std::vector<RobotConstants> guess;  ///< as configured
  SwarmStart start;
};

/// Replays the recording with the configured calibration, but with larger sigmas: cameras may be
/// turned by degrees and ranges off by decimeters. The replay estimates the clocks and the poses of
/// the robots. All stamps are converted to the clock of the robot that saw the others most often.
/// `on_progress`: 0..1, optional.
[[nodiscard]] Result<SwarmMeasurements> swarm_measurements(
    const SwarmDataset& dataset, const std::function<void(double)>& on_progress);

/// The constants of a robot's configuration. Its first camera must be a Double Sphere.
[[nodiscard]] Result<RobotConstants> configured_constants(const Config& config);

}  // namespace crepes
