/// How well a formation was held, by the truth of the simulated world.
#pragma once

#include "drivers/sim/world.hpp"

namespace crepes {

/// The formation is an equilateral triangle; robot 1 leads and faces its center, robot 2 is on its
/// left, robot 3 on its right, all at the same height.
struct FormationScore {
  double from_s = 0.0;  ///< world time
  double to_s = 0.0;
  double rms_m =
      0.0;  ///< of the followers' distances from their places, in the leader's level axes
  double max_m = 0.0;
  double hidden = 0.0;  ///< the mean share of the time that a pair was hidden from each other
};

/// Sampled fifty times a second.
[[nodiscard]] FormationScore score_formation(const SimWorld& world, double from_s, double to_s);

/// Where a follower belongs, in the leader's level axes [m].
[[nodiscard]] Eigen::Vector3d formation_place(RobotId follower);

}  // namespace crepes
