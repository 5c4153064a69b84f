/// The robots of a reading, at the time of its interval.
#pragma once

#include "estimator/team/belief/team_arcs.hpp"
#include "estimator/team/belief/team_belief.hpp"
#include "estimator/team/belief/team_interval.hpp"
#include "estimator/team/readings/team_instant.hpp"
#include "estimator/team/readings/team_measurement.hpp"

namespace crepes {

/// What readings of an interval are compared with. Refers to its parts, which outlive it.
struct ReadingScene {
  const TeamInterval& interval;
  const TeamTrajectories& paths;
  const TeamInstant& instant;
  const TeamBelief& belief;
  TeamArcs arcs{};

  /// Both are in the belief, and have an IMU over the interval.
  [[nodiscard]] TeamPair pair(RobotId observer, RobotId neighbor) const {
    return {belief.robots.at(observer),
            belief.robots.at(neighbor),
            *interval.member(observer),
            *interval.member(neighbor),
            paths.at(observer),
            paths.at(neighbor),
            instant.states()};
  }
  /// After the beginning of the interval.
  [[nodiscard]] double time_s(Timestamp stamp) const { return to_seconds(stamp - interval.from); }
};

}  // namespace crepes
