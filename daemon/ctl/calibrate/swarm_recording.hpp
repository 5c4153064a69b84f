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

/// Replays the recording with what is configured, and with room for cameras that are turned by
/// degrees and ranges that are off by decimeters: that gives the clocks, as the robots estimate
/// them, and where the robots were. Stamps become those of the robot that had all others in sight
/// most of the time. `on_progress`: 0..1, optional.
[[nodiscard]] Result<SwarmMeasurements> swarm_measurements(
    const SwarmDataset& dataset, const std::function<void(double)>& on_progress);

/// What a robot's configuration says of itself. Its first camera must be a Double Sphere.
[[nodiscard]] Result<RobotConstants> configured_constants(const Config& config);

}  // namespace crepes
