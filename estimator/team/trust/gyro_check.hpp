/// Whether a robot's gyroscope contradicts what its cameras see.
#pragma once

#include <map>
#include <optional>

#include "estimator/team/readings/team_readings.hpp"

namespace crepes {

/// The bearings of a robot change over the interval as if it turned at another rate than its
/// gyroscope reads.
struct GyroContradiction {
  double chi2 = 0.0;        ///< improvement by that rate; three degrees of freedom
  double rate_radps = 0.0;  ///< the difference
  /// One robot alone shows it, as a leap of its light would; or all directions may have leapt at
  /// once, as they do when the camera is knocked.
  bool may_be_leap = false;
};

/// How well a gyroscope agrees with what its cameras see.
struct GyroCheck {
  double chi2 = 0.0;          ///< of all that its cameras see, by what its gyroscope reads
  int dimension = 0;          ///< of `chi2`
  bool is_confirmed = false;  ///< nothing is unlikely; the robot and one that it sees are trusted
  std::optional<GyroContradiction> contradiction;
};

/// Of each robot that sees others long enough. Most of the robots that it sees, and at least two,
/// must agree on a rate that contradicts its gyroscope; or the only one that it sees, if that one
/// sees it where it expects it and agreed until then. Their places and a constant misalignment of
/// the camera cancel. The uncertainty of velocities and of the gyroscope is included.
[[nodiscard]] std::map<RobotId, GyroCheck> gyro_checks(const TeamInterval& interval,
                                                       const TeamTrajectories& paths,
                                                       const TeamBelief& belief);

}  // namespace crepes
