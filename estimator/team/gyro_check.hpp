/// Whether a robot's gyroscope contradicts what its cameras see.
#pragma once

#include <map>

#include "estimator/team/team_readings.hpp"

namespace crepes {

/// The bearings of a robot change over the interval as if it turned at another rate than its
/// gyroscope reads.
struct GyroContradiction {
  double chi2 = 0.0;        ///< improvement by that rate; three degrees of freedom
  double rate_radps = 0.0;  ///< the difference
};

/// Most of the robots that such a robot sees, and at least two, must agree on the rate. Their
/// places and a constant misalignment of the camera cancel. The uncertainty of velocities and of
/// the gyroscope is included.
[[nodiscard]] std::map<RobotId, GyroContradiction> gyro_contradictions(
    const TeamInterval& interval, const TeamTrajectories& paths, const TeamBelief& belief);

}  // namespace crepes
