/// The size of the team, of which bearings at rest say nothing.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "estimator/team/belief/team_belief.hpp"

namespace crepes {

/// The mean relative error of the distances that ranges hold, weighed by the squares of the
/// distances. The distance of a robot that no range reaches follows from bearings and does not
/// count.
struct TeamScale {
  Eigen::VectorXd by_states;  ///< the error is by_states^T x, x the error of all states
  int count = 0;              ///< robots

  /// Over the robots whose motion is `corrected`, one flag a state.
  TeamScale(const TeamBelief& belief, const std::vector<bool>& corrected);
};

}  // namespace crepes
