/// Whether a robot's gyroscope contradicts what its cameras see.
#pragma once

#include <map>

#include "estimator/team/team_readings.hpp"

namespace crepes {

/// The bearings of a robot change over the interval as if it turned at another rate than its
/// gyroscope reads.
struct GyroContradiction {
  double chi2 = 0.0;  ///< of three degrees of freedom: by which that rate explains them better
  double rate_radps = 0.0;  ///< the difference
};

/// Most of the robots that such a robot sees, at least two, must agree on the rate. Their places
/// and a camera's constant misalignment have no part in it; what the belief does not know of
/// velocities and of the gyroscope is allowed for.
[[nodiscard]] std::map<RobotId, GyroContradiction> gyro_contradictions(
    const TeamInterval& interval, const TeamTrajectories& paths, const TeamBelief& belief);

}  // namespace crepes
