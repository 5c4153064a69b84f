/// Whether a recording can calibrate a swarm, and what it lacks.
#pragma once

#include <string>
#include <vector>

#include "estimator/calibration/swarm/swarm_batch.hpp"
#include "estimator/calibration/swarm/swarm_solver.hpp"

namespace crepes {

/// Number of robots, robots without inertial samples or without a pose to start from.
[[nodiscard]] std::vector<std::string> refusals_before_fit(const std::vector<RobotRecord>& records,
                                                           const SwarmStart& start,
                                                           const std::vector<std::string>& names);

/// Of what is used, [from, to]: too short, gaps in the IMU's samples, robots that nobody sees or
/// that see nobody. The sightings are those of this time.
[[nodiscard]] std::vector<std::string> refusals_of_window(const std::vector<RobotRecord>& records,
                                                          Timestamp from, Timestamp to,
                                                          const std::vector<std::string>& names);

/// Adds refusals (residuals, contradictions, cameras that remain uncertain) and warnings.
void judge_swarm(const SwarmSolution& solution, const std::vector<std::string>& names,
                 SwarmBatchResult& result);

}  // namespace crepes
