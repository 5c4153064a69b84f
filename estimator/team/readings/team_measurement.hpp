/// Bearings and ranges between two robots of the team, linearized at one instant of their interval.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "estimator/team/belief/robot_trajectory.hpp"
#include "estimator/team/belief/team_arcs.hpp"
#include "estimator/team/belief/team_interval.hpp"
#include "estimator/team/belief/team_state.hpp"
#include "estimator/team/readings/team_instant.hpp"

namespace crepes {

/// A measurement of one or two dimensions, z = h(x) + residual, and the states of the instant that
/// it depends on.
struct TeamRow {
  static constexpr int kMaxColumns = 2 * FreeMotionAt::kMotion + 8;  ///< clocks and six constants

  int dimension = 0;
  int size = 0;  ///< of the columns that are used
  Eigen::Vector2d residual = Eigen::Vector2d::Zero();
  Eigen::Matrix<double, 2, kMaxColumns> H;  ///< the first `dimension` rows are used
  std::array<int, kMaxColumns> columns{};   ///< of the instant's covariance
  double variance = 0.0;                    ///< in each dimension

  /// The innovation's covariance H P H^T + R, with the instant's P.
  [[nodiscard]] Eigen::Matrix2d covariance(const Eigen::MatrixXd& P) const;
};

/// Two robots over an interval. `observer` measures.
struct TeamPair {
  const TeamRobot& observer;
  const TeamRobot& neighbor;
  const TeamMember& observer_member;
  const TeamMember& neighbor_member;
  const RobotTrajectory& observer_path;
  const RobotTrajectory& neighbor_path;
  const InstantStates& states;

  /// The neighbor's clock when the observer's shows `t_s`.
  [[nodiscard]] double neighbor_time_s(double t_s) const {
    return t_s + neighbor.clock_s - observer.clock_s;
  }
};

/// All bearings of one camera to one robot within an interval are one measurement: the errors of
/// lens and spot last longer than that. `reading`s are turned to the instant `t_s` of the row.
///
///   u = TeamCamera::seen(d / |d|),  d = R_i^T (p_j + R_j l_j - p_i) - c_i
///
/// with robot j at its own clock's time t + tau_j - tau_i. All times are by the observer's clock.
class SightModel {
 public:
  /// Empty if the robots are too near to each other.
  [[nodiscard]] static std::optional<SightModel> at(const TeamPair& pair, const TeamCamera& camera,
                                                    double t_s, double sigma_rad);

  /// The direction in the camera, and axes across it.
  [[nodiscard]] const Eigen::Vector3d& predicted() const { return predicted_; }
  [[nodiscard]] const Eigen::Matrix<double, 3, 2>& across() const { return across_; }
  /// Residual zero.
  [[nodiscard]] const TeamRow& row() const { return row_; }
  /// In the plane across the predicted direction. `t_s` is the time of the bearing. Empty if it
  /// points backwards.
  [[nodiscard]] std::optional<Eigen::Vector2d> residual(const TeamPair& pair,
                                                        const TeamCamera& camera,
                                                        const Eigen::Vector3d& u_B,
                                                        double t_s) const;

 private:
  Eigen::Vector3d predicted_ = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 3, 2> across_;
  TeamRow row_;
};

/// r = |p_j + R_j q_j - p_i - R_i q_i| + a_i + a_j + b, and its time within the interval.
/// `spread` is that of the neighbor's position relative to the observer's. A range about a
/// direction that is not known is not linear in the position: the mean of its second-order term
/// |dp|^2 / 2d across the direction corrects the residual, its variance counts as noise
/// (second-order filter; Bar-Shalom, Li and Kirubarajan 2001, 10.3). Empty if the robots are too
/// near to each other.
[[nodiscard]] std::optional<TeamRow> range_row(const TeamPair& pair, const TeamRangeBias& bias,
                                               const RangeReading& reading, double t_s,
                                               const RelativeSpread& spread);

}  // namespace crepes
