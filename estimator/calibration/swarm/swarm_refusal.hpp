/// Whether a recording can calibrate a swarm, and what it lacks.
#pragma once

#include <string>
#include <vector>

#include "estimator/calibration/swarm/swarm_batch.hpp"
#include "estimator/calibration/swarm/swarm_solver.hpp"

namespace crepes {

/// Number of robots, robots that nobody sees or that see nobody, robots without a pose to start
/// from, gaps in the IMU's samples.
[[nodiscard]] std::vector<std::string> refusals_before_fit(const std::vector<RobotRecord>& records,
                                                           const SwarmStart& start,
                                                           const std::vector<std::string>& names);

/// Too short.
[[nodiscard]] std::vector<std::string> refusals_of_length(double seconds);

/// Adds refusals (residuals, contradictions, cameras that remain uncertain) and warnings.
void judge_swarm(const SwarmSolution& solution, const std::vector<std::string>& names,
                 SwarmBatchResult& result);

}  // namespace crepes
