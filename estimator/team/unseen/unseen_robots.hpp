/// Robots that nobody has seen, but whose IMU and ranges are known.
#pragma once

#include <deque>
#include <map>

#include "estimator/team/belief/team_belief.hpp"
#include "estimator/team/belief/team_interval.hpp"
#include "estimator/team/unseen/range_place.hpp"

namespace crepes {

/// Remembers some seconds of what they measured and was measured to them. A bearing of such a robot
/// or by it ends that: then estimates will place it.
class UnseenRobots {
 public:
  /// With the belief at the beginning of the interval.
  void add(const TeamInterval& interval, const TeamBelief& belief);

  /// Those that ranges to trusted robots locate, in the frame of self at the end of the latest
  /// interval. They are tried once a second.
  [[nodiscard]] std::map<RobotId, TeamPlace> places(const TeamInterval& interval,
                                                    const TeamBelief& belief) const;

 private:
  struct Unseen {
    std::deque<UnseenInterval> intervals;
    Duration lasted{};  ///< these
    Duration since{};   ///< all, with those that are forgotten
  };

  Timestamp end_ = kNever;  ///< of the latest interval
  std::map<RobotId, Unseen> unseen_;
};

}  // namespace crepes
