/// Carries a pose of the team's filter to the newest IMU samples.
#pragma once

#include "estimator/core/imu_history.hpp"
#include "estimator/core/team_solution.hpp"
#include "estimator/relative/propagation.hpp"

namespace crepes {

/// The IMUs that carry a pose, with what the team's filter knows of their biases.
struct TeamImus {
  const ImuHistory& imu_B;
  const ImuHistory& imu_N;
  ImuBiasEstimate bias_B;
  ImuBiasEstimate bias_N;
};

/// The pose at `to`, with the errors that the IMUs' noise and the remains of their biases add. The
/// biases' errors have become errors of the motion already, so that their correlation counts.
[[nodiscard]] TeamPose predicted(const TeamPose& pose, const TeamImus& imus, Timestamp from,
                                 Timestamp to, const ProcessNoise& noise);

}  // namespace crepes
