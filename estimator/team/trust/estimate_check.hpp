/// Whose broadcast estimates contradict what everybody measured.
#pragma once

#include <map>
#include <vector>

#include "estimator/team/belief/team_belief.hpp"

namespace crepes {

/// The team's filter uses a robot's estimates only to start with. They are checked because other
/// programs of the swarm may believe them.
class EstimateCheck {
 public:
  /// The estimates of an interval, with the belief at its end.
  void add(const TeamInterval& interval, const TeamBelief& belief);

  /// Robots most of whose estimates, of at least two others, are grossly wrong.
  [[nodiscard]] std::vector<TeamFault> faults() const;

 private:
  struct Doubt {
    Agreement agreement;
    double error_m = 0.0;  ///< of the latest that was wrong
  };
  std::map<std::pair<RobotId, RobotId>, Doubt> doubts_;  ///< by who estimates whom
};

}  // namespace crepes
