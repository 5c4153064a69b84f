/// Whether a robot's gyroscope contradicts what its cameras see.
#pragma once

#include <map>
#include <optional>

#include "estimator/team/team_readings.hpp"

namespace crepes {

/// The bearings of a robot change over the interval as if it turned at another rate than its
/// gyroscope reads.
struct GyroContradiction {
  double chi2 = 0.0;  ///< of three degrees of freedom: by which that rate explains them better
  double rate_radps = 0.0;  ///< the difference
};

struct GyroCheck {
  double chi2 = 0.0;  ///< of all that its cameras see, by what its gyroscope reads
  int dimension = 0;  ///< of `chi2`
  std::optional<GyroContradiction> contradiction;
};

/// Of each robot that sees anybody long enough. Most of the robots that it sees, at least two, must
/// agree on a rate that contradicts its gyroscope. Their places and a camera's constant
/// misalignment have no part in it; what the belief does not know of velocities and of the
/// gyroscope is allowed for.
[[nodiscard]] std::map<RobotId, GyroCheck> gyro_checks(const TeamInterval& interval,
                                                       const TeamTrajectories& paths,
                                                       const TeamBelief& belief);

}  // namespace crepes
