/// The instant of an interval at which the motions of all robots explain its readings.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "estimator/team/belief/motion_image.hpp"
#include "estimator/team/belief/team_belief.hpp"

namespace crepes {

/// The states that readings depend on: first all robots' motions [p, v, theta] at `t_s`, each by
/// its own clock, then clocks, antenna delays, cameras and range biases as the belief has them. An
/// IMU's biases act through the motions.
struct InstantStates {
  double t_s = 0.0;            ///< after the beginning of the interval
  int size = 0;                ///< of all
  int self_motion = 0;         ///< where this robot's motion is, which the belief has not
  std::vector<int> of_belief;  ///< for each state of the belief; negative if no reading sees it
  std::vector<int> constants;  ///< states of the belief that follow the motions, in this order

  /// Of nothing.
  InstantStates() = default;
  /// Of all robots in the belief.
  InstantStates(const TeamBelief& belief, double time_s);

  /// Where a state of the belief is.
  [[nodiscard]] int of(int state) const { return of_belief[static_cast<std::size_t>(state)]; }
  /// Where a robot's motion is.
  [[nodiscard]] int motion_of(const TeamRobot& robot) const {
    return robot.motion_index < 0 ? self_motion : of(robot.motion_index);
  }
};

/// These states are far fewer than the readings of a large team, so that readings are summed up as
/// information about them first, and the belief's whole covariance is corrected by that.
class TeamInstant {
 public:
  /// `paths` has all robots of the belief. The instant is the step of the trajectories nearest to
  /// `t_s`.
  TeamInstant(const TeamBelief& belief, const TeamTrajectories& paths, double t_s);

  /// Which they are.
  [[nodiscard]] const InstantStates& states() const { return states_; }
  /// Their joint covariance.
  [[nodiscard]] const Eigen::MatrixXd& covariance() const { return covariance_; }
  /// Covariance of all states of the belief with these.
  [[nodiscard]] const Eigen::MatrixXd& with_belief() const { return with_belief_; }
  /// An error of the belief, as these states have it.
  [[nodiscard]] Eigen::VectorXd image_of(const Eigen::VectorXd& dx) const;

 private:
  InstantStates states_;
  std::vector<MotionImage> motions_;
  Eigen::MatrixXd with_belief_;
  Eigen::MatrixXd covariance_;
};

}  // namespace crepes
