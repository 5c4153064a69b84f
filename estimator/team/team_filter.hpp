/// The team as one estimate: every robot's motion and calibration in one Kalman filter.
#pragma once

#include <map>
#include <set>
#include <utility>
#include <vector>

#include "estimator/team/belief/team_belief.hpp"
#include "estimator/team/belief/team_place.hpp"
#include "estimator/team/readings/team_readings.hpp"
#include "estimator/team/team_links.hpp"
#include "estimator/team/trust/estimate_check.hpp"
#include "estimator/team/trust/team_memory.hpp"
#include "estimator/team/trust/team_trust.hpp"
#include "estimator/team/unseen/unseen_robots.hpp"

namespace crepes {

/// A joint error-state filter over keyframes, one an interval. The frame falls freely with this
/// robot at the keyframe, so that this robot's motion there is known by definition, and gravity and
/// the team's common motion are no states.
///
/// States: each other robot's [p, v, theta]; every robot's gyroscope and accelerometer bias, its
/// gyroscope's scale and axis errors, its antenna delay and its clock; every camera's misalignment
/// and lens error; a range bias a pair. All pairs of a robot share its states, so that the team
/// calibrates itself. The bearings of the interval are linearized at their mean time, through the
/// IMUs, and correct it together (iterated least squares); then its ranges do. Then all motions
/// advance to the end of the interval, the next keyframe.
///
/// A new robot is on probation for a second: until its measurements agree with the others, they
/// correct nobody but itself, and while they contradict it, it has no pose. A camera that
/// contradicts the others is realigned by them; if it still does, it is left out.
/// `TeamSettings::max_robots` are estimated jointly, those that are best connected with each other.
/// Robots beyond are located through them.
/// A gyroscope that was found false has spoilt all calibrations. They are taken from a belief of
/// some seconds ago, and estimates place the robots again.
/// Deterministic.
class TeamFilter {
 public:
  TeamFilter() = default;
  /// Goes on from this belief.
  explicit TeamFilter(TeamBelief belief) : belief_(std::move(belief)) {}

  /// Intervals must follow each other. After a gap the filter begins anew. Without this robot's IMU
  /// it forgets all, and the solution is empty.
  [[nodiscard]] TeamSolution step(const TeamInterval& interval);
  /// At the end of the last interval.
  [[nodiscard]] const TeamBelief& belief() const { return belief_; }
  /// Goes on from another belief of that time.
  void replace(TeamBelief belief) { belief_ = std::move(belief); }
  /// Whether one of its cameras was knocked out of its calibration, of which filters of pairs know
  /// nothing.
  [[nodiscard]] bool is_knocked(RobotId robot) const {
    return trust_.knocked_camera(robot).has_value();
  }

 private:
  using Stage = TeamReadings::Stage;

  /// Removes robots that are not to be believed, recalls an earlier belief or begins anew. True if
  /// no reading may correct this interval: estimates must place again, at its end, whoever is left.
  [[nodiscard]] bool remove_members(const TeamInterval& interval);
  [[nodiscard]] bool must_recall_own(const TeamInterval& interval) const;
  /// Robots with turned cameras. True if one of them was trusted: it has strained the calibrations.
  [[nodiscard]] bool remove_turned(const TeamInterval& interval);
  [[nodiscard]] bool are_others_plausible() const;
  void remove(RobotId id);
  /// After false gyroscopes. False if there is no earlier belief.
  [[nodiscard]] bool recall(const TeamInterval& interval, const std::vector<RobotId>& false_gyros);
  void begin_anew(const TeamInterval& interval);
  [[nodiscard]] std::vector<RobotId> false_gyros(const TeamInterval& interval);
  [[nodiscard]] std::set<RobotId> liars() const;
  /// Whoever joins in exchange for another one; RobotId{} if nobody does.
  [[nodiscard]] RobotId exchange_member(const TeamInterval& interval);
  void append_cameras(const TeamInterval& interval);
  /// False if the covariance has become singular.
  [[nodiscard]] bool correct(const TeamInterval& interval);
  [[nodiscard]] bool correct(const TeamInterval& interval, Stage stage, TeamReadings readings);
  [[nodiscard]] std::vector<bool> corrected_states(Stage stage) const;
  void add_members(const TeamInterval& interval, RobotId first, bool are_placed,
                   TeamSolution& solution);
  [[nodiscard]] std::map<RobotId, TeamPlace> unseen_places(const TeamInterval& interval,
                                                           bool are_placed);
  void add_member(const TeamInterval& interval, RobotId id, const TeamPlace& place);
  void place_member(RobotId id, const TeamPlace& place);
  void report(const TeamInterval& interval, bool are_placed, TeamSolution& solution) const;

  TeamBelief belief_;
  TeamMemory memory_;
  TeamTrust trust_;
  TeamLinks links_;
  UnseenRobots unseen_;
  EstimateCheck estimates_;
  std::vector<TeamResidual> residuals_;  ///< of the interval
};

}  // namespace crepes
