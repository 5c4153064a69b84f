/// Whether a robot's gyroscope contradicts what its cameras see.
#pragma once

#include <map>
#include <optional>

#include "estimator/team/team_readings.hpp"

namespace crepes {

/// The bearings of a robot change over the interval as if it turned at another rate than its
/// gyroscope reads.
struct GyroContradiction {
  double chi2 = 0.0;        ///< improvement by that rate; three degrees of freedom
  double rate_radps = 0.0;  ///< the difference
};

/// How well a gyroscope agrees with what its cameras see.
struct GyroCheck {
  double chi2 = 0.0;  ///< of all that its cameras see, by what its gyroscope reads
  int dimension = 0;  ///< of `chi2`
  std::optional<GyroContradiction> contradiction;
};

/// Of each robot that sees others long enough. Most of the robots that it sees, and at least two,
/// must agree on a rate that contradicts its gyroscope. Their places and a constant misalignment of
/// the camera cancel. The uncertainty of velocities and of the gyroscope is included.
[[nodiscard]] std::map<RobotId, GyroCheck> gyro_checks(const TeamInterval& interval,
                                                       const TeamTrajectories& paths,
                                                       const TeamBelief& belief);

}  // namespace crepes
