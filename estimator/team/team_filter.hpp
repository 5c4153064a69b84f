/// The team as one estimate: every robot's motion and calibration in one Kalman filter.
#pragma once

#include <Eigen/Core>
#include <map>
#include <utility>
#include <vector>

#include "estimator/team/team_interval.hpp"
#include "estimator/team/team_measurement.hpp"
#include "estimator/team/team_state.hpp"

namespace crepes {

/// A joint error-state filter over keyframes, one an interval. The frame falls freely with this
/// robot at the keyframe, so that this robot's motion there is known by definition, and gravity and
/// the team's common motion are no states.
///
/// States: each other robot's [p, v, theta]; every robot's gyroscope and accelerometer bias, its
/// gyroscope's scale and axis errors and its antenna delay; every camera's misalignment; a range
/// bias a pair. All pairs of a robot share its states, so that the team calibrates itself. Bearings
/// and ranges of the interval are linearized at its beginning, through the IMUs, and correct it
/// together (iterated least squares). Then all motions advance to the end of the interval, the next
/// keyframe.
///
/// A new robot is on probation for a second: until its measurements agree with the others, they
/// correct nobody but itself. A camera that contradicts the others is realigned by them; if it
/// still does, it is left out.
/// `TeamSettings::max_robots` are estimated jointly. Robots beyond are located through them.
/// Deterministic.
class TeamFilter {
 public:
  /// Intervals must follow each other. After a gap the filter begins anew. Without this robot's IMU
  /// it forgets all, and the solution is empty.
  [[nodiscard]] TeamSolution step(const TeamInterval& interval);

 private:
  using Pair = std::pair<RobotId, RobotId>;
  using Trajectories = std::map<RobotId, RobotTrajectory>;
  struct Sight;
  struct Ranging;
  struct Readings;
  enum class Stage { kTrusted, kProbation };

  void reset(const TeamInterval& interval);
  using Witnesses = std::map<RobotId, Agreement>;
  [[nodiscard]] Witnesses witnesses(bool with_turned) const;
  [[nodiscard]] bool is_turned(RobotId observer, const TeamCamera& camera) const;
  void remove_members(const TeamInterval& interval);
  void remove(RobotId id);
  [[nodiscard]] int recent_losses(RobotId robot) const;
  void trust_members();
  void judge_cameras(const TeamInterval& interval);
  [[nodiscard]] bool is_realigned(RobotId robot) const;
  void add_calibrations(const TeamInterval& interval);
  [[nodiscard]] Trajectories trajectories(const TeamInterval& interval) const;
  [[nodiscard]] Readings readings(const TeamInterval& interval, Stage stage) const;
  [[nodiscard]] bool takes_part(RobotId observer, RobotId neighbor, Stage stage) const;
  [[nodiscard]] TeamPair pair(const TeamInterval& interval, const Trajectories& paths,
                              RobotId observer, RobotId neighbor) const;
  void gate(const TeamInterval& interval, const Trajectories& paths, Readings& readings);
  [[nodiscard]] std::vector<TeamRow> rows(const TeamInterval& interval, const Trajectories& paths,
                                          const Readings& readings) const;
  [[nodiscard]] Eigen::Matrix3d position_covariance(RobotId from, RobotId to) const;
  /// False if the covariance has become singular.
  [[nodiscard]] bool correct(const TeamInterval& interval);
  [[nodiscard]] bool correct(const TeamInterval& interval, Stage stage, Readings readings);
  [[nodiscard]] std::vector<bool> corrected_states(Stage stage) const;
  void inject(const Eigen::VectorXd& dx);
  void advance(const TeamInterval& interval);
  void add_members(const TeamInterval& interval, TeamSolution& solution);
  void add_member(const TeamInterval& interval, RobotId id, const GaussianPose& T_S_N,
                  const Eigen::Vector3d& v_S_N);
  [[nodiscard]] GaussianPose known_pose(RobotId id) const;
  void report(const TeamInterval& interval, TeamSolution& solution) const;
  void report_cameras(const TeamInterval& interval, RobotId id, TeamSolution& solution) const;
  void report_ranges(RobotId id, TeamSolution& solution) const;

  /// Appends independent states of this sigma. Returns their index.
  int append(int count, double sigma);
  /// The states of a robot's IMU and UWB module.
  int append_calibration(const Priors& priors);
  void erase(int index, int count);

  RobotId self_{};
  Timestamp stamp_{};
  std::map<RobotId, TeamRobot> robots_;  ///< with this robot
  std::map<Pair, TeamRangeBias> ranges_;
  struct Losses {
    Timestamp last{};
    int count = 0;
  };
  std::map<RobotId, Losses> losses_;  ///< of robots that were contradicted
  struct Realignment {
    Timestamp since{};
    bool is_refused = false;
  };
  std::map<RobotId, Realignment> realigned_;  ///< robots whose cameras are turned
  Eigen::MatrixXd P_;
};

}  // namespace crepes
