/// Four robots that see each other, for tests of what the team's trust makes of their agreement.
#pragma once

#include <gtest/gtest.h>

#include <vector>

#include "estimator/team/trust/team_trust.hpp"
#include "tests/support/simulated_belief.hpp"

namespace crepes::test {

inline constexpr RobotId kSecond{2};
inline constexpr RobotId kThird{3};
inline constexpr RobotId kAccused{4};
inline constexpr Agreement kAgrees{.fused = 10.0};
inline constexpr Agreement kContradicts{.gated = 10.0};

using Ids = std::vector<RobotId>;

/// Four robots that see each other, and what each camera thinks of what it sees.
class TrustOfFour : public testing::Test {
 protected:
  TrustOfFour() {
    const TrueMotions motions = motions_of(team_);
    interval_ = team_.next();
    belief_ = true_belief(motions, interval_);
    for (auto& [id, robot] : belief_.robots)
      for (const RobotId other : {kSelf, kSecond, kThird, kAccused})
        if (other != id) robot.cameras[0].agreement[other] = kAgrees;
  }

  TeamCamera& camera_of(RobotId robot) { return belief_.robots.at(robot).cameras[0]; }
  void contradict_what_it_sees(RobotId observer) {
    for (auto& [other, agreement] : camera_of(observer).agreement) agreement = kContradicts;
  }
  void contradict_its_place(RobotId robot) {
    for (const RobotId observer : {kSelf, kSecond, kThird, kAccused})
      if (observer != robot) camera_of(observer).agreement[robot] = kContradicts;
  }
  void all_agree_again() {
    for (auto& [id, robot] : belief_.robots)
      for (auto& [other, agreement] : robot.cameras[0].agreement) agreement = kAgrees;
  }
  /// What `one` and `other` think of their ranges to each other, by which those are too long.
  void range(RobotId one, RobotId other, Agreement of_one, Agreement of_other, double long_m) {
    TeamRangeBias& range = belief_.ranges.at(ordered(one, other));
    range.agreement = {{one, of_one}, {other, of_other}};
    range.refused_m = {{one, long_m}, {other, long_m}};
  }
  /// Likewise between a robot and all others.
  void range_to_all(RobotId robot, Agreement by_it, Agreement to_it, double long_m) {
    for (const RobotId other : {kSelf, kSecond, kThird, kAccused})
      if (other != robot) range(robot, other, by_it, to_it, long_m);
  }
  /// Without anything that happens.
  void wait(Duration time) {
    belief_.stamp += time;
    interval_.from += time;
    interval_.to += time;
  }
  Ids lost() { return trust_.note_lost(interval_, belief_); }
  Ids turned() { return trust_.note_turned(interval_, belief_); }

  SimulatedTeam team_{1};
  TeamInterval interval_;
  TeamBelief belief_;
  TeamTrust trust_;
};

}  // namespace crepes::test
