/// Finds robots whose measurements contradict the others'.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "estimator/team/belief/team_belief.hpp"
#include "estimator/team/trust/gyro_check.hpp"

namespace crepes {

/// Remembers which robots were contradicted, and whose cameras are turned.
class TeamTrust {
 public:
  /// Notices robots that must be removed from the belief, and counts that: they have no IMU, are
  /// too uncertain, or are contradicted by most cameras that see them. In a tie, the robot that
  /// came last is removed. Also robots whose place most ranges contradict, in both directions, once
  /// a minute. Also robots whose camera agrees with nobody and contradicts only whom other cameras
  /// confirm, at most twice in ten seconds: their attitude is wrong. Also robots whose camera was
  /// refused for so long that it is tried again. Forgets verdicts that have ended.
  [[nodiscard]] std::vector<RobotId> note_lost(const TeamInterval& interval,
                                               const TeamBelief& belief);

  /// Notices robots whose gyroscope has contradicted for some intervals what their cameras see, and
  /// robots whose gyroscope was found false of late and whose camera now contradicts most of what
  /// it sees: their attitude is wrong.
  [[nodiscard]] std::vector<RobotId> note_false_gyros(const TeamInterval& interval,
                                                      const TeamBelief& belief,
                                                      const std::map<RobotId, GyroCheck>& checks);

  /// Notices cameras that may have been knocked: they agreed until now, and within this interval
  /// most robots that they see were far from where they should be.
  void note_leaps(const TeamInterval& interval, const TeamBelief& belief,
                  const std::vector<TeamResidual>& residuals);

  /// Notices robots of which a camera is newly found turned. Their attitude is wrong too. They must
  /// be restarted with an uncertain misalignment, so that the others' measurements determine it. If
  /// the camera contradicts the others again, it is refused.
  [[nodiscard]] std::vector<RobotId> note_turned(const TeamInterval& interval,
                                                 const TeamBelief& belief);

  /// Notices robots that were trusted too early and have set a wrong scale: the ranges of at least
  /// half of the pairs are refused, and such a robot is part of every other pair, but no robot of
  /// every refused one. True if one is newly found. Then all robots must be restarted, and this one
  /// is trusted last.
  [[nodiscard]] bool note_misleading(const TeamBelief& belief);
  /// Ends the probation of robots whose measurements agreed with the trusted ones for long enough.
  void end_probations(TeamBelief& belief) const;

  /// Robots whose gyroscope was found false within the last second.
  [[nodiscard]] std::vector<TeamFault> gyro_faults(Timestamp now) const;
  /// Whether it is one of them.
  [[nodiscard]] bool is_gyro_false(RobotId robot, Timestamp now) const;

  /// Whether the gyroscope of a trusted robot was false of late, so that all states may be
  /// disturbed.
  [[nodiscard]] bool is_everybody_strained(Timestamp now) const;

  /// Its camera that was found turned soon after all that it sees had leapt at once, as when
  /// something hits the camera; empty if there is none. Until then it was as calibrated, and from
  /// then to the verdict its bearings were refused.
  [[nodiscard]] std::optional<std::size_t> knocked_camera(RobotId robot) const;
  /// Covariance of the misalignment of its cameras, which is also that of its attitude, in body
  /// axes [rad^2]. Empty if its cameras are as calibrated.
  [[nodiscard]] std::optional<Eigen::Matrix3d> turn_covariance(RobotId robot) const;
  /// Whether a robot's cameras contradicted the others again after they were realigned.
  [[nodiscard]] bool is_refused(RobotId robot) const { return verdicts_.at(robot).is_refused; }
  /// The factor on the start's sigmas of a robot that was recently contradicted.
  [[nodiscard]] double doubt(RobotId robot, Timestamp now) const;

 private:
  struct Losses {
    Timestamp last = kNever;
    int count = 0;
  };
  struct GyroDoubt {
    double chi2 = 0.0;               ///< of the latest intervals
    std::optional<Timestamp> found;  ///< when it was last too large
    /// The same, of a robot that was trusted; it was not while what followed may be its effect.
    std::optional<Timestamp> unconfirmed;
    std::optional<Timestamp> confirmed;  ///< when its cameras first agreed with it after that
    double rate_radps = 0.0;             ///< how wrong the gyroscope was then
    Timestamp leap = kNever;             ///< when it was last contradicted by what may be a leap
    Losses as_trusted;                   ///< when it was found although the robot was trusted
  };
  struct Verdict {
    /// When its camera was last found turned; after a while it may be repaired.
    Timestamp shown = kNever;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    int count = 0;  ///< how often its cameras were found turned
    bool is_refused = false;
    bool is_withdrawn = false;
    std::optional<std::size_t> knocked{};  ///< which of its cameras
  };
  [[nodiscard]] bool note_misplaced(const TeamBelief& belief, RobotId id);
  void review_verdicts(const TeamInterval& interval, const TeamBelief& belief);
  void convict(RobotId robot, std::size_t camera, Timestamp now, const Eigen::Vector3d& turn);
  [[nodiscard]] bool is_strained(RobotId robot, Timestamp now) const;
  [[nodiscard]] bool may_be_disoriented(RobotId robot, Timestamp now) const;
  [[nodiscard]] bool is_disoriented(const TeamBelief& belief, RobotId id) const;
  [[nodiscard]] bool is_realigned(RobotId robot) const;
  [[nodiscard]] bool has_leapt(RobotId robot, std::size_t camera, Timestamp now) const;
  [[nodiscard]] bool has_misled(RobotId robot, Timestamp now) const;
  [[nodiscard]] Duration probation(RobotId robot, Timestamp now) const;
  [[nodiscard]] static int recent(const std::map<RobotId, Losses>& all, RobotId robot,
                                  Timestamp now);
  static void count(std::map<RobotId, Losses>& all, RobotId robot, Timestamp now);

  std::map<RobotId, Losses> losses_;    ///< in the wrong place
  std::map<RobotId, Losses> restarts_;  ///< with a wrong attitude
  std::map<RobotId, Verdict> verdicts_;
  std::map<RobotId, GyroDoubt> gyro_doubts_;
  std::map<std::pair<RobotId, std::size_t>, Timestamp> leaps_;  ///< of what a camera sees
  std::map<RobotId, Timestamp> misplaced_;                      ///< when ranges showed that
  std::map<RobotId, Timestamp> misled_by_;                      ///< when that robot was found
};

/// Whether the bearings of a robot and to it agree with its place, four in five of them, and its
/// ranges do not contradict it. False in the interval in which it started: they are yet to come.
[[nodiscard]] bool has_plausible_place(const TeamBelief& belief, RobotId id);

}  // namespace crepes
