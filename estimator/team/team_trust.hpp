/// Whose measurements contradict the others'.
#pragma once

#include <map>
#include <vector>

#include "estimator/team/team_belief.hpp"

namespace crepes {

/// Remembers which robots were contradicted, and whose cameras are turned.
class TeamTrust {
 public:
  /// Robots that must leave the belief: without IMU, known too badly, or contradicted by most
  /// cameras that see them. Where as many agree, the robot that came last is in the wrong.
  [[nodiscard]] std::vector<RobotId> lost(const TeamInterval& interval, const TeamBelief& belief);

  /// Robots with a camera that is turned, newly. Such a robot has a wrong attitude too. It must
  /// start anew with a camera whose direction is unknown, so that the others' measurements
  /// determine it. If that camera contradicts them again, it is refused.
  [[nodiscard]] std::vector<RobotId> turned(const TeamInterval& interval, const TeamBelief& belief);

  /// The directions of its cameras are unknown.
  [[nodiscard]] bool is_realigned(RobotId robot, Timestamp now) const;
  /// A realigned robot's cameras contradicted the others after that, too.
  [[nodiscard]] bool is_refused(RobotId robot) const { return realigned_.at(robot).is_refused; }
  /// How many times less certain a robot starts that was contradicted of late.
  [[nodiscard]] double doubt(RobotId robot, Timestamp now) const;

 private:
  struct Losses {
    Timestamp last{};
    int count = 0;
  };
  struct Realignment {
    Timestamp since{};
    bool is_refused = false;
  };
  [[nodiscard]] int recent_losses(RobotId robot, Timestamp now) const;

  std::map<RobotId, Losses> losses_;
  std::map<RobotId, Realignment> realigned_;
};

/// Ends the probation of robots whose measurements agreed with the trusted ones for long enough.
void end_probations(TeamBelief& belief);

/// Cameras that are turned or refused, robots most of whose ranges are refused, and clocks that are
/// off.
[[nodiscard]] std::vector<TeamFault> faults_of(const TeamBelief& belief, const Priors& priors);

}  // namespace crepes
