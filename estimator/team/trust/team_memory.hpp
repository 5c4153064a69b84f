/// The belief as it was before a fault that was found only now.
#pragma once

#include <deque>
#include <optional>

#include "estimator/team/belief/team_belief.hpp"

namespace crepes {

/// Some beliefs of the last seconds. A false gyroscope is found within half a second; by then it
/// has moved everybody's calibration. The belief from before is older, but right.
class TeamMemory {
 public:
  /// Keeps a copy once a second, of a team.
  void add(const TeamBelief& belief);
  /// What happens to the IMUs meanwhile: their biases may change with the vibration.
  void add_vibration(const TeamInterval& interval);
  /// Forgets a robot, which may be another one when it comes back.
  void remove(RobotId id);
  void clear() { beliefs_.clear(); }
  /// The newest belief that is at least two seconds old, if there is one. Forgets the later ones.
  [[nodiscard]] std::optional<TeamBelief> recall(Timestamp now);

 private:
  std::deque<TeamBelief> beliefs_;  ///< the oldest first
};

}  // namespace crepes
