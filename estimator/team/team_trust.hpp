/// Whose measurements contradict the others'.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <vector>

#include "estimator/team/gyro_check.hpp"
#include "estimator/team/team_belief.hpp"

namespace crepes {

/// Remembers which robots were contradicted, and whose cameras are turned.
class TeamTrust {
 public:
  /// Robots that must leave the belief: without IMU, known too badly, or contradicted by most
  /// cameras that see them. Where as many agree, the robot that came last is in the wrong. And
  /// robots whose camera was refused for so long that it is tried again.
  [[nodiscard]] std::vector<RobotId> lost(const TeamInterval& interval, const TeamBelief& belief);

  /// Robots whose gyroscope has contradicted for some intervals what their cameras see.
  [[nodiscard]] std::vector<RobotId> false_gyros(const TeamInterval& interval,
                                                 const TeamBelief& belief,
                                                 const std::map<RobotId, GyroCheck>& checks);

  /// Robots with a camera that is turned, newly. Such a robot has a wrong attitude too. It must
  /// start anew with a camera that may be turned, so that the others' measurements determine it. If
  /// that camera contradicts them again, it is refused.
  [[nodiscard]] std::vector<RobotId> turned(const TeamInterval& interval, const TeamBelief& belief);

  /// At least half of the pairs' ranges are refused, and one robot has a part in all others, newly:
  /// trusted too early, it has set a wrong scale. All must start anew, and it is trusted last.
  [[nodiscard]] bool is_misled(const TeamBelief& belief);
  /// Ends the probation of robots whose measurements agreed with the trusted ones for long enough.
  void end_probations(TeamBelief& belief) const;

  /// Robots whose gyroscope was false within the last second.
  [[nodiscard]] std::vector<TeamFault> gyro_faults(Timestamp now) const;

  /// How uncertain the misalignment of its cameras is, and likewise its attitude, in its body's
  /// axes [rad^2]. None if its cameras are as they were calibrated.
  [[nodiscard]] std::optional<Eigen::Matrix3d> turn_covariance(RobotId robot) const;
  /// A realigned robot's cameras contradicted the others after that, too.
  [[nodiscard]] bool is_refused(RobotId robot) const { return verdicts_.at(robot).is_refused; }
  /// How many times less certain a robot starts that was contradicted of late.
  [[nodiscard]] double doubt(RobotId robot, Timestamp now) const;

 private:
  struct Losses {
    Timestamp last{};
    int count = 0;
  };
  struct GyroDoubt {
    double chi2 = 0.0;               ///< of the latest intervals
    std::optional<Timestamp> found;  ///< when it was last too large
    double rate_radps = 0.0;         ///< how wrong the gyroscope was then
  };
  struct Verdict {
    Timestamp shown{};  ///< when its camera was last found turned; after a while it may be repaired
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    int count = 0;  ///< how often its cameras were found turned
    bool is_refused = false;
    bool is_withdrawn = false;
  };
  void review_verdicts(const TeamInterval& interval, const TeamBelief& belief);
  void convict(RobotId robot, Timestamp now, const Eigen::Matrix3d& covariance);
  [[nodiscard]] bool is_strained(RobotId robot, Timestamp now) const;
  [[nodiscard]] bool is_realigned(RobotId robot) const;
  [[nodiscard]] bool has_misled(RobotId robot, Timestamp now) const;
  [[nodiscard]] int recent_losses(RobotId robot, Timestamp now) const;

  std::map<RobotId, Losses> losses_;
  std::map<RobotId, Verdict> verdicts_;
  std::map<RobotId, GyroDoubt> gyro_doubts_;
  std::map<RobotId, Timestamp> misled_by_;  ///< when that robot was found
};

/// What is known of all robots' sensors. A camera is turned if its misalignment is significant, and
/// beyond what a calibration leaves.
[[nodiscard]] std::vector<RobotCalibration> calibrations_of(const TeamBelief& belief,
                                                            const Priors& priors);

/// Cameras that are turned or refused, robots most of whose ranges are refused, and clocks that are
/// off. `calibrations` are those of `belief`.
[[nodiscard]] std::vector<TeamFault> faults_of(const TeamBelief& belief,
                                               const std::vector<RobotCalibration>& calibrations);

}  // namespace crepes
