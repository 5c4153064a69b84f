/// What the team's filter knows: robots, cameras and pairs with their joint covariance.
#pragma once

#include <Eigen/Core>
#include <map>

#include "estimator/core/pose.hpp"
#include "estimator/core/team_solution.hpp"
#include "estimator/team/belief/team_interval.hpp"
#include "estimator/team/belief/team_state.hpp"

namespace crepes {

/// Each robot's motion over an interval.
using TeamTrajectories = std::map<RobotId, RobotTrajectory>;

/// The frame falls freely with this robot at `stamp`, the keyframe. So this robot's motion there is
/// known by definition, and gravity and the team's common motion are no states.
struct TeamBelief {
  static constexpr double kLeastVariance = 1e-12;  ///< of a prior, so that P stays regular

  RobotId self{};
  Timestamp stamp{};
  std::map<RobotId, TeamRobot> robots;  ///< with this robot
  std::map<RobotPair, TeamRangeBias> ranges;
  Eigen::MatrixXd P;

  /// This robot alone, calibrated as well as the priors say.
  [[nodiscard]] static TeamBelief beginning(const TeamInterval& interval);

  /// This earlier belief at the beginning of the interval: the calibrations of all robots that have
  /// an IMU there. Where the others are is unknown until `place`. Readings since then are
  /// forgotten.
  [[nodiscard]] TeamBelief calibrations_at(const TeamInterval& interval) const;

  /// Appends independent states of this sigma. Returns their index.
  int append(int count, double sigma);
  /// The states of a robot's IMU and UWB module.
  int append_calibration(const Priors& priors);
  /// For pairs that measure ranges for the first time.
  void append_range_biases(const TeamInterval& interval);
  /// Sets where a robot is, in the frame of this robot, with the covariance of [p, v, theta].
  void place(RobotId id, const FreeMotion& motion, const MotionMatrix& covariance);
  /// Makes the error of a placed robot's motion one that follows from another robot's, with this
  /// derivative, and an independent one besides.
  void connect(RobotId id, RobotId via, const MotionMatrix& by_via, const MotionMatrix& own);
  /// Makes a robot's IMU as uncertain as one that was never calibrated. Its errors stay the best
  /// guess.
  void doubt_imu(RobotId id, const Priors& priors);
  /// Makes the misalignment of a robot's camera as uncertain as this, and free of its prior.
  void realign(RobotId id, std::size_t camera, const Eigen::Matrix3d& covariance);
  /// Removes a robot and its states.
  void remove(RobotId id);

  /// The motions of all robots over the interval.
  [[nodiscard]] TeamTrajectories trajectories(const TeamInterval& interval) const;
  /// T_S_N with S this robot.
  [[nodiscard]] GaussianPose pose(RobotId id) const;
  /// What is known of a robot's sensors.
  [[nodiscard]] RobotCalibration calibration(RobotId id) const;
  /// Of the position of `to` relative to `from`.
  [[nodiscard]] Eigen::Matrix3d position_covariance(RobotId from, RobotId to) const;

  /// Adds an error to the states.
  void inject(const Eigen::VectorXd& dx);
  /// After the attitude's error at this index was injected, what is left of it is about the new
  /// attitude.
  void reset_attitude(int index, const Eigen::VectorXd& dx);
  /// Adds what the IMUs' biases may have changed with the vibration over the interval.
  void add_vibration(const TeamInterval& interval);
  /// Moves the keyframe to the end of the interval.
  void advance(const TeamInterval& interval);

 private:
  void erase(int index, int count);
  void forget(int index, int count);
  void set_imu_prior(int bias_index, const Priors& priors);
  void add_drift(const TeamInterval& interval, double dt);
};

/// Near hovering, an accelerometer's scale and axis errors act as a bias that gravity causes.
[[nodiscard]] double accel_bias_variance(const Priors& priors);

}  // namespace crepes
