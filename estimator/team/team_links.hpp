/// How well each robot is connected with those that are estimated jointly.
#pragma once

#include <map>
#include <optional>
#include <set>

#include "estimator/team/belief/team_belief.hpp"

namespace crepes {

/// Decides whether a robot beyond the filter's size should take the place of one within. A robot's
/// links are the robots of the filter that it sees or that see it, in the mean of the last seconds;
/// one that no estimate connects with the filter has none, because it could not be placed.
class TeamLinks {
 public:
  /// Of robots with an IMU over the interval. What `liars` estimate connects nobody.
  void add(const TeamInterval& interval, const TeamBelief& belief, const std::set<RobotId>& liars);

  /// Two robots that change places.
  struct Exchange {
    RobotId leaves{};  ///< the filter
    RobotId joins{};   ///< in its place
  };
  /// The worst connected robot of the belief and the best beyond it, if the latter is clearly
  /// better connected. At most one in two seconds, so that whoever joins can be trusted first.
  [[nodiscard]] std::optional<Exchange> exchange(Timestamp now, const TeamBelief& belief);

 private:
  std::map<RobotId, double> links_;
  std::optional<Timestamp> last_;
};

}  // namespace crepes
