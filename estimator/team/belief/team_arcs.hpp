/// Positions and velocities that turn with an attitude that is not known well.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <vector>

#include "estimator/relative/range_update.hpp"
#include "estimator/team/belief/team_belief.hpp"

namespace crepes {

/// The error of a robot's position relative to another one, to second order.
struct RelativeSpread {
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  std::vector<Eigen::Vector3d> levers{};  ///< with which it turns, one an open attitude
  Eigen::MatrixXd with_turns{};           ///< covariance of [position, attitudes]

  /// By how much the distance along this unit vector is longer than to first order.
  [[nodiscard]] RangeCurvature curvature(const Eigen::Vector3d& direction, double distance_m) const;
};

/// Mean and covariance of [p, v].
struct Bend {
  Vector6d mean = Vector6d::Zero();
  Matrix6d covariance = Matrix6d::Zero();
};

/// A robot that sees another one, and whose heading is open, is somewhere on an arc about it. A
/// Gaussian of [p, v, theta] contains the arc's tangent only. So the errors of a robot N with an
/// open attitude are those of [d, w, R], where the other one, the pivot M, is in its axes:
///   p_N = p_M - R_N d,  v_N = v_M - R_N w.
/// A correction by theta then moves the robot along the arc, and what is left of the error has the
/// arc's new tangent. What bearings and ranges of M tell does not depend on R_N, so that no
/// information on it is invented (with this robot as the pivot, that is the invariant filter;
/// Barrau and Bonnabel 2017).
///
/// The covariance is kept by [p, v, theta], linearized about the present mean. The pivot is the
/// robot relative to which d is known best.
class TeamArcs {
 public:
  /// An attitude that is known better than this, all axes together, is not open [rad].
  static constexpr double kOpen = 0.02;

  /// None.
  TeamArcs() = default;
  /// Of all robots.
  explicit TeamArcs(const TeamBelief& belief);
  /// Of the robots whose states are `corrected`, one flag a state.
  TeamArcs(const TeamBelief& belief, const std::vector<bool>& corrected);

  /// Whether no attitude is open.
  [[nodiscard]] bool empty() const { return arcs_.empty(); }
  /// Whether the robot with this motion is on an arc.
  [[nodiscard]] bool contains(int motion) const;
  /// By how far states that are moved by `dx` along the tangents are off the arcs.
  [[nodiscard]] Eigen::VectorXd off_tangent(const Eigen::VectorXd& dx) const;
  /// An error of the states that were moved by `from`, linearized where they are moved by `to`.
  [[nodiscard]] Eigen::VectorXd carried(const Eigen::VectorXd& error, const Eigen::VectorXd& from,
                                        const Eigen::VectorXd& to) const;
  /// Likewise the covariance of errors. Attitudes of robots on arcs are reset, too.
  void carry(const Eigen::VectorXd& from, const Eigen::VectorXd& to, Eigen::MatrixXd& P) const;
  /// Of the position of `to` relative to `from`.
  [[nodiscard]] RelativeSpread spread(const TeamBelief& belief, RobotId from, RobotId to) const;
  /// Of what a robot's position and velocity are off the tangents.
  [[nodiscard]] Bend bend(const TeamBelief& belief, RobotId id) const;

 private:
  /// One robot and its pivot, as the belief has them.
  struct Arc {
    int motion = 0;
    int pivot_motion = -1;  ///< none if that is this robot itself
    FreeMotion at{};
    FreeMotion pivot{};
  };
  /// The lever with which something turns with an attitude.
  struct Lever {
    int attitude = 0;  ///< the states theta of the robot
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    Eigen::Vector3d arm = Eigen::Vector3d::Zero();
  };
  struct Moved;

  [[nodiscard]] std::vector<Moved> moved(const Eigen::VectorXd& dx) const;
  void carry_rows(const std::vector<Moved>& from, const std::vector<Moved>& to,
                  Eigen::MatrixXd& errors) const;
  static Eigen::Vector3d along_position(const Arc& arc);
  [[nodiscard]] std::vector<Lever> levers_of(
      int motion, const std::function<Eigen::Vector3d(const Arc&)>& arm) const;
  [[nodiscard]] static Bend bend_of(const TeamBelief& belief,
                                    const std::array<std::vector<Lever>, 2>& levers);

  std::vector<Arc> arcs_;  ///< pivots come before the robots that turn about them
};

}  // namespace crepes
