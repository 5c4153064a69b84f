#include "estimator/calibration/swarm/swarm_linearization.hpp"

#include <ceres/jet.h>

#include <array>
#include <cmath>
#include <vector>

#include "estimator/calibration/swarm/swarm_factors.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

namespace constant_at = swarm_constants;

constexpr int kBody = ArrowSystem::kState;
constexpr int kInterval = interval_columns::kSize;
// Columns of a reading: the intervals of both robots, then constants, then the pair's drift.
constexpr int kBodies = 2 * kInterval;
constexpr int kSightingRow = kBodies + 13 + 3 + 2 + 2;
constexpr int kRangeRow = kBodies + 6 + 6 + 2;

/// A body at an instant. Rows: [theta (right), p].
struct BodyInstant {
  BodyAt at;
  Eigen::Matrix<double, 6, kInterval> J;
  Eigen::Matrix<double, 6, 1> rate;  ///< by time
};

BodyInstant instant_of(const BodyPlace<IntervalJet>& place) {
  BodyInstant instant;
  Eigen::Matrix3d R;
  Eigen::Matrix<double, 6, kInterval + 1> J;
  for (int i = 0; i < 3; ++i) {
    instant.at.p_W[i] = place.p_W[i].a;
    J.row(3 + i) = place.p_W[i].v.transpose();
    for (int j = 0; j < 3; ++j) R(i, j) = place.R_W_B(i, j).a;
  }
  instant.at.q_W_B = Eigen::Quaterniond(R);
  // R^T dR = [dtheta]x
  for (int i = 0; i < 3; ++i) {
    const int a = (i + 1) % 3;
    const int b = (i + 2) % 3;
    J.row(i).setZero();
    for (int row = 0; row < 3; ++row) {
      J.row(i) +=
          0.5 * (R(row, b) * place.R_W_B(row, a).v - R(row, a) * place.R_W_B(row, b).v).transpose();
    }
  }
  instant.J = J.leftCols<kInterval>();
  instant.rate = J.col(kInterval);
  return instant;
}

std::vector<Columns> columns_of_bodies(const SwarmReading& reading) {
  return {{0, kBody, reading.observer_knot, body_index(reading.observer)},
          {kBody, 15, Columns::kConstants,
           constants_index(reading.observer) + constant_at::kGyroMatrix},
          {kInterval, kBody, reading.other_knot, body_index(reading.other)},
          {kInterval + kBody, 15, Columns::kConstants,
           constants_index(reading.other) + constant_at::kGyroMatrix}};
}

std::vector<Columns> columns_of_sighting(const SwarmReading& reading) {
  std::vector<Columns> all = columns_of_bodies(reading);
  const int observer = constants_index(reading.observer);
  const int other = constants_index(reading.other);
  all.push_back({kBodies, 13, Columns::kConstants, observer + constant_at::kLens});
  all.push_back({kBodies + 13, 3, Columns::kConstants, other + constant_at::kRing});
  all.push_back({kBodies + 16, 2, Columns::kConstants, observer + constant_at::kClock});
  all.push_back({kBodies + 18, 2, Columns::kConstants, other + constant_at::kClock});
  return all;
}

std::vector<Columns> columns_of_range(const SwarmReading& reading, std::size_t robots) {
  const auto pair = static_cast<int>(pair_index(reading.observer, reading.other, robots));
  std::vector<Columns> all = columns_of_bodies(reading);
  all.push_back(
      {kBodies, 6, Columns::kConstants, constants_index(reading.observer) + constant_at::kAntenna});
  all.push_back({kBodies + 6, 6, Columns::kConstants,
                 constants_index(reading.other) + constant_at::kAntenna});
  all.push_back({kBodies + 12, 1, Columns::kConstants, constants_index(robots) + pair});
  all.push_back({kBodies + 13, 1, reading.observer_knot, body_index(robots) + pair});
  return all;
}

}  // namespace

void SwarmLinearization::imu(std::size_t robot, std::size_t knot,
                             const BodyInterval<IntervalJet>& interval,
                             const ArrowSystem::StateMatrix& L) {
  using JetVector = Eigen::Matrix<IntervalJet, kBody, 1>;
  const CameraKnot& next = state_.knots[robot][knot + 1];
  const Motion<IntervalJet>& end = interval.end();
  const Matrix3<IntervalJet> turn =
      end.R_W_B.transpose() * next.q_W_B.toRotationMatrix().cast<IntervalJet>();
  JetVector r;
  r << small_log<IntervalJet>(turn), next.v_W.cast<IntervalJet>() - end.v_W,
      next.p_W.cast<IntervalJet>() - end.p_W,
      next.gyro_bias.cast<IntervalJet>() - interval.gyro_bias(),
      next.accel_bias.cast<IntervalJet>() - interval.accel_bias();
  Eigen::MatrixXd rows(kBody, kInterval + kBody + 1);
  ArrowSystem::StateMatrix J_next = ArrowSystem::StateMatrix::Identity();
  J_next.topLeftCorner<3, 3>() = so3_right_jacobian_inverse({r[0].a, r[1].a, r[2].a});
  for (int i = 0; i < kBody; ++i) {
    rows.row(i).head<kInterval>() = r[i].v.head<kInterval>().transpose();
    rows(i, kInterval + kBody) = r[i].a;
  }
  rows.middleCols<kBody>(kInterval) = J_next;
  const std::array<Columns, 3> columns{
      Columns{0, kBody, knot, body_index(robot)},
      Columns{kBody, 15, Columns::kConstants, constants_index(robot) + constant_at::kGyroMatrix},
      Columns{kInterval, kBody, knot + 1, body_index(robot)}};
  add_rows(L * rows, columns, system_);
}

void SwarmLinearization::sighting(const SwarmReading& reading, const BodyPlace<IntervalJet>& from,
                                  const BodyPlace<IntervalJet>& to, const Eigen::Vector2d& uv,
                                  double sigma, double weight) {
  namespace column = sighting_columns;
  const BodyInstant observer = instant_of(from);
  const BodyInstant other = instant_of(to);
  const auto factor = linearize_sighting(state_.robots[reading.observer], observer.at,
                                         state_.robots[reading.other], other.at);
  if (!factor) return;
  const auto J_observer = factor->J.middleCols<6>(column::kObserver);
  const auto J_other = factor->J.middleCols<6>(column::kOther);
  const Eigen::Vector2d by_other_time = J_other * other.rate;
  Eigen::Matrix<double, 2, kSightingRow + 1> row;
  row << J_observer * observer.J, J_other * other.J, factor->J.middleCols<12>(column::kCamera),
      J_observer * observer.rate + by_other_time, factor->J.middleCols<3>(column::kRing),
      -by_other_time, -reading.stamp_s * by_other_time, by_other_time,
      reading.common_s * by_other_time, factor->uv - uv;
  buffer(sightings_, reading, kSightingRow).next<2>(columns_of_sighting(reading)) =
      row * (std::sqrt(weight) / sigma);
}

void SwarmLinearization::range(const SwarmReading& reading, const BodyPlace<IntervalJet>& from,
                               const BodyPlace<IntervalJet>& to, double range_m, double sigma,
                               double weight) {
  namespace column = range_columns;
  const BodyInstant observer = instant_of(from);
  const BodyInstant other = instant_of(to);
  const auto factor = linearize_antenna_range(state_.robots[reading.observer], observer.at,
                                              state_.robots[reading.other], other.at);
  if (!factor) return;
  const auto J_observer = factor->J.middleCols<6>(column::kObserver);
  const auto J_other = factor->J.middleCols<6>(column::kOther);
  const double by_other_time = J_other.dot(other.rate.transpose());
  Eigen::Matrix<double, 1, kRangeRow + 1> row;
  row << J_observer * observer.J, J_other * other.J, factor->J.middleCols<3>(column::kAntenna),
      factor->J(column::kDelay), -by_other_time, -reading.stamp_s * by_other_time,
      factor->J.middleCols<3>(column::kOtherAntenna), factor->J(column::kOtherDelay), by_other_time,
      reading.common_s * by_other_time, 1.0, 1.0,
      factor->range_m + pair_part_m(state_, reading) - range_m;
  buffer(ranges_, reading, kRangeRow).next<1>(columns_of_range(reading, state_.robots.size())) =
      row * (std::sqrt(weight) / sigma);
}

void SwarmLinearization::drift(std::size_t knot, std::size_t pair, double decay, double sigma) {
  const int i = body_index(state_.robots.size()) + static_cast<int>(pair);
  const double r = state_.pair_drift_m[knot + 1][pair] - decay * state_.pair_drift_m[knot][pair];
  const double weight = 1.0 / (sigma * sigma);
  system_.diagonal(knot)(i, i) += weight * decay * decay;
  system_.to_next(knot)(i, i) -= weight * decay;
  system_.diagonal(knot + 1)(i, i) += weight;
  system_.gradient(knot)(i) += weight * decay * r;
  system_.gradient(knot + 1)(i) -= weight * r;
}

void SwarmLinearization::prior_of_drift(std::size_t pair, double r, double slope) {
  const int i = body_index(state_.robots.size()) + static_cast<int>(pair);
  system_.diagonal(0)(i, i) += slope * slope;
  system_.gradient(0)(i) -= slope * r;
}

void SwarmLinearization::prior_of_constant(int index, double r, double slope) {
  system_.constants()(index, index) += slope * slope;
  system_.constants_gradient()(index) -= slope * r;
}

void SwarmLinearization::prior_of_first(int where, const Eigen::RowVector3d& row, double r) {
  system_.diagonal(0).block<3, 3>(where, where) += row.transpose() * row;
  system_.gradient(0).segment<3>(where) -= row.transpose() * r;
}

void SwarmLinearization::finish() {
  for (auto& [pair, rows] : sightings_) rows.flush();
  for (auto& [pair, rows] : ranges_) rows.flush();
}

RowBuffer& SwarmLinearization::buffer(Buffers& buffers, const SwarmReading& reading, int columns) {
  return buffers.try_emplace({reading.observer, reading.other}, columns, system_).first->second;
}

}  // namespace crepes
