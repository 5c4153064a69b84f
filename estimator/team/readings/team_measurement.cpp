#include "estimator/team/readings/team_measurement.hpp"

#include <algorithm>
#include <span>

#include "estimator/core/contract.hpp"
#include "estimator/core/so3.hpp"
#include "estimator/relative/range_update.hpp"

namespace crepes {
namespace {

constexpr double kMinDistance = 0.10;  // m; nearer, the rings' extent sets the direction

template <class Derived>
void add_columns(int index, const Eigen::MatrixBase<Derived>& by_state, TeamRow& row) {
  for (int i = 0; i < by_state.cols(); ++i) {
    row.columns.at(static_cast<std::size_t>(row.size)) = index + i;
    row.H.col(row.size++) = by_state.col(i);
  }
}

/// Adds the derivatives by a robot's motion at the instant, from which its IMU carries it on as
/// `by_earlier` says, and what its IMU's noise has added since the beginning, in the mean of the
/// axes. What its biases add from the instant on is of second order in the time.
void add_motion(const Eigen::Matrix<double, 2, 3>& by_p,
                const Eigen::Matrix<double, 2, 3>& by_theta, const RobotTrajectory& path,
                const FreeMotionAt& at, const TeamRobot& robot, const InstantStates& states,
                TeamRow& row) {
  const FreeMotionAt& start = path.nearest(states.t_s);
  const double t_s = at.t_s - start.t_s;
  const Eigen::Vector3d turned = at.motion.p_F - start.motion.p_F - t_s * start.motion.v_F;
  const int index = states.motion_of(robot);
  add_columns(index, by_p, row);
  add_columns(index + 3, t_s * by_p, row);
  const Eigen::Matrix<double, 2, 3> by_turn =
      by_theta * at.motion.R().transpose() - by_p * hat(turned);
  add_columns(index + 6, by_turn * start.motion.R(), row);
  row.variance += (at.noise.topLeftCorner<3, 3>().trace() * by_p.squaredNorm() +
                   at.noise.bottomRightCorner<3, 3>().trace() * by_theta.squaredNorm()) /
                  (3.0 * row.dimension);
}

/// Adds the derivatives by both clocks, for what moves with the neighbor.
void add_clocks(const Eigen::Vector2d& by_neighbor, const TeamPair& pair, TeamRow& row) {
  add_columns(pair.states.of(pair.neighbor.clock_index()), by_neighbor, row);
  add_columns(pair.states.of(pair.observer.clock_index()), -by_neighbor, row);
}

/// From the camera to the neighbor's LEDs, in the observer's body frame.
struct LineOfSight {
  Eigen::Matrix3d R_F_N;
  Eigen::Matrix3d R_B_F;
  Eigen::Vector3d p_B_M;
  Eigen::Vector3d d;
};

LineOfSight line_of_sight(const TeamPair& pair, const TeamCamera& camera, const FreeMotion& i,
                          const FreeMotion& j) {
  LineOfSight line{.R_F_N = j.R(), .R_B_F = i.R().transpose(), .p_B_M = {}, .d = {}};
  line.p_B_M = line.R_B_F * (j.p_F + line.R_F_N * pair.neighbor_member.p_body_led - i.p_F);
  line.d = line.p_B_M - camera.p_B_C;
  return line;
}

}  // namespace

Eigen::Matrix2d TeamRow::covariance(const Eigen::MatrixXd& P) const {
  using Column = Eigen::Matrix<double, kMaxColumns, 1>;
  const std::span states = std::span(columns).first(static_cast<std::size_t>(size));
  CREPES_EXPECT(
      std::ranges::all_of(states, [&](int state) { return state >= 0 && state < P.rows(); }),
      "a row depends on states of the instant");
  Eigen::Matrix<double, kMaxColumns, 2> PH = Eigen::Matrix<double, kMaxColumns, 2>::Zero();
  Column of_state = Column::Zero();
  for (Eigen::Index a = 0; const int state : states) {
    const auto of_all = P.col(state);
    for (Eigen::Index b = 0; const int other : states) of_state.coeffRef(b++) = of_all.coeff(other);
    PH.col(0) += H(0, a) * of_state;
    if (dimension == 2) PH.col(1) += H(1, a) * of_state;
    ++a;
  }
  return H.leftCols(size) * PH.topRows(size) + variance * Eigen::Matrix2d::Identity();
}

std::optional<SightModel> SightModel::at(const TeamPair& pair, const TeamCamera& camera, double t_s,
                                         double sigma_rad) {
  const FreeMotionAt& i = pair.observer_path.nearest(t_s);
  const double t_j_s = pair.neighbor_time_s(t_s);
  const FreeMotionAt& j = pair.neighbor_path.nearest(t_j_s);
  const LineOfSight line = line_of_sight(pair, camera, i.motion, j.motion);
  const double distance = line.d.norm();
  if (distance < kMinDistance) return std::nullopt;
  const Eigen::Vector3d direction = line.d / distance;
  const Eigen::Matrix3d M = so3_exp(camera.misalignment).toRotationMatrix();

  SightModel model;
  model.predicted_ = camera.seen(direction);
  model.across_ = tangent_basis(model.predicted_);
  TeamRow& row = model.row_;
  row.dimension = 2;
  row.variance = sigma_rad * sigma_rad;
  const Eigen::Vector3d turned = M * direction;
  const Eigen::Matrix3d bent = (1.0 - turned.dot(camera.lens)) * Eigen::Matrix3d::Identity() -
                               turned * camera.lens.transpose();
  const Eigen::Matrix<double, 2, 3> across = model.across_.transpose() * bent * M;
  const Eigen::Matrix<double, 2, 3> by_d =
      across * (Eigen::Matrix3d::Identity() - direction * direction.transpose()) / distance;
  add_motion(-by_d * line.R_B_F, by_d * hat(line.p_B_M), pair.observer_path, i, pair.observer,
             pair.states, row);
  add_motion(by_d * line.R_B_F,
             -by_d * line.R_B_F * line.R_F_N * hat(pair.neighbor_member.p_body_led),
             pair.neighbor_path, j, pair.neighbor, pair.states, row);
  add_columns(pair.states.of(camera.index),
              -across * hat(direction) * so3_right_jacobian(camera.misalignment), row);
  add_columns(
      pair.states.of(camera.lens_index()),
      model.across_.transpose() * (Eigen::Matrix3d::Identity() - turned * turned.transpose()), row);
  add_clocks(
      by_d * line.R_B_F * pair.neighbor_path.velocity_F(t_j_s, pair.neighbor_member.p_body_led),
      pair, row);
  return model;
}

std::optional<Eigen::Vector2d> SightModel::residual(const TeamPair& pair, const TeamCamera& camera,
                                                    const Eigen::Vector3d& u_B, double t_s) const {
  const LineOfSight line = line_of_sight(pair, camera, pair.observer_path.motion_at(t_s),
                                         pair.neighbor_path.motion_at(pair.neighbor_time_s(t_s)));
  const Eigen::Vector3d then = camera.seen(line.d.normalized());
  const Eigen::Vector3d u = shortest_rotation(then, predicted_) * u_B;
  if (!(predicted_.dot(u) > 0.0)) return std::nullopt;
  return angles_across(predicted_, across_, u);
}

std::optional<TeamRow> range_row(const TeamPair& pair, const TeamRangeBias& bias,
                                 const RangeReading& reading, double t_s,
                                 const RelativeSpread& spread) {
  const double t_j_s = pair.neighbor_time_s(t_s);
  const FreeMotionAt& i = pair.observer_path.nearest(t_s);
  const FreeMotionAt& j = pair.neighbor_path.nearest(t_j_s);
  const FreeMotion now_i = pair.observer_path.motion_at(t_s);
  const FreeMotion now_j = pair.neighbor_path.motion_at(t_j_s);
  const Eigen::Vector3d& q_i = pair.observer_member.p_body_uwb;
  const Eigen::Vector3d& q_j = pair.neighbor_member.p_body_uwb;
  const Eigen::Vector3d d = now_j.p_F + now_j.q_F_B * q_j - now_i.p_F - now_i.q_F_B * q_i;
  const double distance = d.norm();
  if (distance < kMinDistance) return std::nullopt;

  TeamRow row;
  row.dimension = 1;
  row.residual.x() = reading.range_m - distance - pair.observer.antenna_delay_m -
                     pair.neighbor.antenna_delay_m - bias.bias_m;
  row.variance = reading.sigma_m * reading.sigma_m;
  const Eigen::RowVector3d u = d.transpose() / distance;
  const auto in_first_row = [](const Eigen::RowVector3d& v) {
    Eigen::Matrix<double, 2, 3> both = Eigen::Matrix<double, 2, 3>::Zero();
    both.row(0) = v;
    return both;
  };
  add_motion(in_first_row(-u), in_first_row(u * now_i.R() * hat(q_i)), pair.observer_path, i,
             pair.observer, pair.states, row);
  add_motion(in_first_row(u), in_first_row(-u * now_j.R() * hat(q_j)), pair.neighbor_path, j,
             pair.neighbor, pair.states, row);
  for (const int index : {pair.observer.delay_index(), pair.neighbor.delay_index(), bias.index})
    add_columns(pair.states.of(index), Eigen::Vector2d(1.0, 0.0), row);
  add_clocks(Eigen::Vector2d(u.dot(pair.neighbor_path.velocity_F(t_j_s, q_j)), 0.0), pair, row);

  const RangeCurvature curvature = spread.curvature(d / distance, distance);
  row.residual.x() -= curvature.mean_m;
  row.variance += curvature.variance_m2;
  return row;
}

}  // namespace crepes
