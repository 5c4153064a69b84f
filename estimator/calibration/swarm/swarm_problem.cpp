#include "estimator/calibration/swarm/swarm_problem.hpp"

#include <ceres/jet.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "estimator/calibration/batch/knot_noise.hpp"
#include "estimator/calibration/swarm/body_interval.hpp"
#include "estimator/calibration/swarm/swarm_factors.hpp"
#include "estimator/calibration/swarm/swarm_rows.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

namespace at = swarm_constants;

constexpr double kShortestSpacing_s = 0.02;
constexpr double kLongestSpacing_s = 0.1;
constexpr double kUsualRobots = 4.0;
constexpr double kGaugeSigma = 1e-4;    // position and heading of the first robot: free to choose
constexpr double kClockGauge_s = 1e-6;  // of the first robot's clock
constexpr double kSkewGauge = 1e-8;
constexpr double kVelocitySigma = 3.0;  // of the first knots [m/s]
constexpr double kInvalidCost_px = 200.0;
constexpr double kLeastBias_m = 1e-3;

constexpr int kBody = ArrowSystem::kState;
constexpr int kInterval = interval_columns::kSize;
using TimeJet = ceres::Jet<double, kInterval + 1>;

BodyAt plain(const BodyPlace<double>& place) {
  return {Eigen::Quaterniond(place.R_W_B), place.p_W};
}

/// A body at an instant. Rows: [theta (right), p].
struct BodyInstant {
  BodyAt at;
  Eigen::Matrix<double, 6, kInterval> J;
  Eigen::Matrix<double, 6, 1> rate;  ///< by time
};

BodyInstant instant_of(const BodyPlace<TimeJet>& place) {
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

int body_at(std::size_t robot) { return static_cast<int>(robot) * kBody; }
int constants_at(std::size_t robot) { return static_cast<int>(robot) * at::kSize; }

/// A reading of `observer`, and where both robots' intervals have it.
struct Reading {
  std::size_t observer = 0;
  std::size_t other = 0;
  std::size_t index = 0;
  std::size_t observer_knot = 0;
  std::size_t other_knot = 0;
  double stamp_s = 0.0;  ///< by the observer's IMU
  double common_s = 0.0;
};

constexpr int kBodies = 2 * kInterval;
constexpr int kSightingRow = kBodies + 13 + 3 + 2 + 2;
constexpr int kRangeRow = kBodies + 6 + 6 + 2;

std::vector<Columns> columns_of_bodies(const Reading& reading) {
  return {
      {0, kBody, reading.observer_knot, body_at(reading.observer)},
      {kBody, 15, Columns::kConstants, constants_at(reading.observer) + at::kGyroMatrix},
      {kInterval, kBody, reading.other_knot, body_at(reading.other)},
      {kInterval + kBody, 15, Columns::kConstants, constants_at(reading.other) + at::kGyroMatrix}};
}

std::vector<Columns> columns_of_sighting(const Reading& reading) {
  std::vector<Columns> all = columns_of_bodies(reading);
  const int observer = constants_at(reading.observer);
  const int other = constants_at(reading.other);
  all.push_back({kBodies, 13, Columns::kConstants, observer + at::kLens});
  all.push_back({kBodies + 13, 3, Columns::kConstants, other + at::kRing});
  all.push_back({kBodies + 16, 2, Columns::kConstants, observer + at::kClock});
  all.push_back({kBodies + 18, 2, Columns::kConstants, other + at::kClock});
  return all;
}

std::vector<Columns> columns_of_range(const Reading& reading, std::size_t robots) {
  const auto pair = static_cast<int>(pair_index(reading.observer, reading.other, robots));
  std::vector<Columns> all = columns_of_bodies(reading);
  all.push_back({kBodies, 6, Columns::kConstants, constants_at(reading.observer) + at::kAntenna});
  all.push_back({kBodies + 6, 6, Columns::kConstants, constants_at(reading.other) + at::kAntenna});
  all.push_back({kBodies + 12, 1, Columns::kConstants, constants_at(robots) + pair});
  all.push_back({kBodies + 13, 1, reading.observer_knot, body_at(robots) + pair});
  return all;
}

/// What the pair itself lengthens a range by.
double pair_part(const SwarmState& state, const Reading& reading) {
  const std::size_t pair = pair_index(reading.observer, reading.other, state.robots.size());
  return state.pair_bias_m[pair] + state.pair_drift_m[reading.observer_knot][pair];
}

/// Sums half the squares, and keeps the residuals if there is a place for them.
class PlainVisitor {
 public:
  PlainVisitor(const SwarmState& state, SwarmResiduals* residuals)
      : state_(state), residuals_(residuals) {}

  /// Residuals are those of all readings.
  [[nodiscard]] bool wants(double weight) const { return weight > 0.0 || residuals_ != nullptr; }
  void imu(std::size_t robot, std::size_t knot, const BodyInterval<double>& interval,
           const ArrowSystem::StateMatrix& L) {
    const CameraKnot& next = state_.knots[robot][knot + 1];
    ArrowSystem::StateVector r;
    const Motion<double>& end = interval.end();
    r << small_log<double>(end.R_W_B.transpose() * next.q_W_B.toRotationMatrix()),
        next.v_W - end.v_W, next.p_W - end.p_W, next.gyro_bias - interval.gyro_bias(),
        next.accel_bias - interval.accel_bias();
    sum_ += 0.5 * (L * r).squaredNorm();
  }
  void sighting(const Reading& reading, const BodyPlace<double>& from, const BodyPlace<double>& to,
                const Eigen::Vector2d& uv, double sigma, double weight) {
    const auto seen = predicted_spot(state_.robots[reading.observer], plain(from),
                                     state_.robots[reading.other], plain(to));
    const Eigen::Vector2d r = seen ? Eigen::Vector2d(*seen - uv) : Eigen::Vector2d::Zero();
    const double square = seen ? r.squaredNorm() : kInvalidCost_px * kInvalidCost_px;
    sum_ += 0.5 * weight * square / (sigma * sigma);
    if (residuals_ != nullptr)
      residuals_->sightings[reading.observer][reading.index] = {r, seen.has_value()};
  }
  void range(const Reading& reading, const BodyPlace<double>& from, const BodyPlace<double>& to,
             double range_m, double sigma, double weight) {
    const auto factor = linearize_antenna_range(state_.robots[reading.observer], plain(from),
                                                state_.robots[reading.other], plain(to));
    if (!factor) return;
    const double r = range_m - factor->range_m - pair_part(state_, reading);
    sum_ += 0.5 * weight * r * r / (sigma * sigma);
    if (residuals_ != nullptr) residuals_->ranges[reading.observer][reading.index] = r;
  }
  void drift(std::size_t knot, std::size_t pair, double decay, double sigma) {
    const double r = state_.pair_drift_m[knot + 1][pair] - decay * state_.pair_drift_m[knot][pair];
    sum_ += 0.5 * r * r / (sigma * sigma);
  }
  void prior_of_drift(std::size_t /*pair*/, double r, double /*slope*/) { sum_ += 0.5 * r * r; }
  void prior_of_constant(int /*index*/, double r, double /*slope*/) { sum_ += 0.5 * r * r; }
  void prior_of_first(int /*where*/, const Eigen::RowVector3d& /*row*/, double r) {
    sum_ += 0.5 * r * r;
  }
  [[nodiscard]] double sum() const { return sum_; }

 private:
  const SwarmState& state_;
  SwarmResiduals* residuals_;
  double sum_ = 0.0;
};

/// Builds the normal equations  J^T J x = -J^T r .
class LinearVisitor {
 public:
  LinearVisitor(const SwarmState& state, TeamArrowSystem& system)
      : state_(state), system_(system) {}

  [[nodiscard]] static bool wants(double weight) { return weight > 0.0; }
  void imu(std::size_t robot, std::size_t knot, const BodyInterval<TimeJet>& interval,
           const ArrowSystem::StateMatrix& L) {
    using JetVector = Eigen::Matrix<TimeJet, kBody, 1>;
    const CameraKnot& next = state_.knots[robot][knot + 1];
    const Motion<TimeJet>& end = interval.end();
    const Matrix3<TimeJet> turn =
        end.R_W_B.transpose() * next.q_W_B.toRotationMatrix().cast<TimeJet>();
    JetVector r;
    r << small_log<TimeJet>(turn), next.v_W.cast<TimeJet>() - end.v_W,
        next.p_W.cast<TimeJet>() - end.p_W, next.gyro_bias.cast<TimeJet>() - interval.gyro_bias(),
        next.accel_bias.cast<TimeJet>() - interval.accel_bias();
    Eigen::MatrixXd rows(kBody, kInterval + kBody + 1);
    ArrowSystem::StateMatrix J_next = ArrowSystem::StateMatrix::Identity();
    J_next.topLeftCorner<3, 3>() = so3_right_jacobian_inverse({r[0].a, r[1].a, r[2].a});
    for (int i = 0; i < kBody; ++i) {
      rows.row(i).head<kInterval>() = r[i].v.head<kInterval>().transpose();
      rows(i, kInterval + kBody) = r[i].a;
    }
    rows.middleCols<kBody>(kInterval) = J_next;
    const std::array<Columns, 3> columns{
        Columns{0, kBody, knot, body_at(robot)},
        Columns{kBody, 15, Columns::kConstants, constants_at(robot) + at::kGyroMatrix},
        Columns{kInterval, kBody, knot + 1, body_at(robot)}};
    add_rows(L * rows, columns, system_);
  }

  void sighting(const Reading& reading, const BodyPlace<TimeJet>& from,
                const BodyPlace<TimeJet>& to, const Eigen::Vector2d& uv, double sigma,
                double weight) {
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

  void range(const Reading& reading, const BodyPlace<TimeJet>& from, const BodyPlace<TimeJet>& to,
             double range_m, double sigma, double weight) {
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
        factor->J.middleCols<3>(column::kOtherAntenna), factor->J(column::kOtherDelay),
        by_other_time, reading.common_s * by_other_time, 1.0, 1.0,
        factor->range_m + pair_part(state_, reading) - range_m;
    buffer(ranges_, reading, kRangeRow).next<1>(columns_of_range(reading, state_.robots.size())) =
        row * (std::sqrt(weight) / sigma);
  }

  void drift(std::size_t knot, std::size_t pair, double decay, double sigma) {
    const int i = body_at(state_.robots.size()) + static_cast<int>(pair);
    const double r = state_.pair_drift_m[knot + 1][pair] - decay * state_.pair_drift_m[knot][pair];
    const double weight = 1.0 / (sigma * sigma);
    system_.diagonal(knot)(i, i) += weight * decay * decay;
    system_.to_next(knot)(i, i) -= weight * decay;
    system_.diagonal(knot + 1)(i, i) += weight;
    system_.gradient(knot)(i) += weight * decay * r;
    system_.gradient(knot + 1)(i) -= weight * r;
  }
  void prior_of_drift(std::size_t pair, double r, double slope) {
    const int i = body_at(state_.robots.size()) + static_cast<int>(pair);
    system_.diagonal(0)(i, i) += slope * slope;
    system_.gradient(0)(i) -= slope * r;
  }
  void prior_of_constant(int index, double r, double slope) {
    system_.constants()(index, index) += slope * slope;
    system_.constants_gradient()(index) -= slope * r;
  }
  void prior_of_first(int where, const Eigen::RowVector3d& row, double r) {
    system_.diagonal(0).block<3, 3>(where, where) += row.transpose() * row;
    system_.gradient(0).segment<3>(where) -= row.transpose() * r;
  }
  void finish() {
    for (auto& [pair, rows] : sightings_) rows.flush();
    for (auto& [pair, rows] : ranges_) rows.flush();
  }

 private:
  using Buffers = std::map<std::pair<std::size_t, std::size_t>, RowBuffer>;
  RowBuffer& buffer(Buffers& buffers, const Reading& reading, int columns) {
    return buffers.try_emplace({reading.observer, reading.other}, columns, system_).first->second;
  }

  const SwarmState& state_;
  TeamArrowSystem& system_;
  Buffers sightings_;
  Buffers ranges_;
};

/// A step's cost grows with the cube of the robots. Noise within an interval is not modelled: where
/// IMUs vibrate, intervals of 0.1 s put levers wrong by three sigma (tests/study).
double knot_spacing(std::size_t robots) {
  const double share = static_cast<double>(robots) / kUsualRobots;
  return std::clamp(kShortestSpacing_s * share * share * share, kShortestSpacing_s,
                    kLongestSpacing_s);
}

/// The samples at which knots stand, by robot. An instant for which a robot has no new sample has
/// no knot at all, so that knots of one number are of one time.
std::vector<std::vector<std::size_t>> knot_samples(const std::vector<std::vector<double>>& imu_s,
                                                   double to_s, double spacing_s) {
  std::vector<std::vector<std::size_t>> samples(imu_s.size());
  for (int k = 0; k * spacing_s <= to_s; ++k) {
    std::vector<std::size_t> now;
    for (std::size_t r = 0; r < imu_s.size(); ++r) {
      const auto found = std::ranges::lower_bound(imu_s[r], k * spacing_s - 1e-9);
      const auto i = static_cast<std::size_t>(found - imu_s[r].begin());
      const bool is_new = samples[r].empty() || i > samples[r].back();
      if (found != imu_s[r].end() && is_new) now.push_back(i);
    }
    if (now.size() < imu_s.size()) continue;
    for (std::size_t r = 0; r < imu_s.size(); ++r) samples[r].push_back(now[r]);
  }
  return samples;
}

}  // namespace

/// The robots' intervals around the one that is visited.
template <class T>
class SwarmWalk {
 public:
  SwarmWalk(const SwarmProblem& problem, const SwarmState& state)
      : problem_(problem), state_(state), intervals_(problem.robots()) {}

  const BodyInterval<T>& interval(std::size_t robot, std::size_t knot) {
    auto& kept = intervals_[robot];
    auto found = kept.find(knot);
    if (found != kept.end()) return found->second;
    while (!kept.empty() && kept.begin()->first + 2 < knot) kept.erase(kept.begin());
    const auto& imu = problem_.records_[robot].imu;
    const std::size_t first = problem_.first_sample_[robot][knot];
    const std::size_t last = problem_.first_sample_[robot][knot + 1];
    const ImuStretch stretch{.samples = std::span(imu).subspan(first, last - first + 1),
                             .after = &imu[std::min(last + 1, imu.size() - 1)]};
    return kept.try_emplace(knot, state_.robots[robot].camera, state_.knots[robot][knot], stretch)
        .first->second;
  }

  BodyPlace<T> at(std::size_t robot, const SwarmProblem::Place& place) {
    return interval(robot, place.knot)
        .at(place.step, seeded<T>(place.tau, interval_columns::kTime));
  }

 private:
  const SwarmProblem& problem_;
  const SwarmState& state_;
  std::vector<std::map<std::size_t, BodyInterval<T>>> intervals_;
};

SwarmProblem::SwarmProblem(std::vector<RobotRecord> records, Timestamp from, Timestamp to)
    : records_(std::move(records)), from_(from), sigma_px_(records_.size(), 1.0) {
  for (const RobotRecord& record : records_) {
    std::vector<double>& times = imu_s_.emplace_back();
    for (const ImuSample& sample : record.imu) times.push_back(seconds(sample.stamp));
    weights_.sightings.emplace_back(record.sightings.size(), 1.0);
    weights_.ranges.emplace_back(record.ranges.size(), 1.0);
  }
  first_sample_ = knot_samples(imu_s_, seconds(to), knot_spacing(robots()));
  set_pair_noise();
}

/// The worse of both robots' biases.
void SwarmProblem::set_pair_noise() {
  pair_noise_.resize(pair_count(robots()));
  for (std::size_t a = 0; a < robots(); ++a) {
    for (std::size_t b = a + 1; b < robots(); ++b) {
      RangeNoise& pair = pair_noise_[pair_index(a, b, robots())];
      const RangeNoise& own = records_[a].range_noise;
      const RangeNoise& other = records_[b].range_noise;
      pair.bias_sigma_m = std::max({kLeastBias_m, own.bias_sigma_m, other.bias_sigma_m});
      pair.bias_drift_m = std::max({kLeastBias_m, own.bias_drift_m, other.bias_drift_m});
      pair.bias_time_s = std::min(own.bias_time_s, other.bias_time_s);
    }
  }
}

std::optional<SwarmProblem::Place> SwarmProblem::place_of(std::size_t robot, double time_s) const {
  const std::vector<double>& times = imu_s_[robot];
  const std::vector<std::size_t>& first = first_sample_[robot];
  if (time_s < times[first.front()] || time_s >= times[first.back()]) return std::nullopt;
  const auto next = std::ranges::upper_bound(times, time_s);
  const auto sample = static_cast<std::size_t>(next - times.begin()) - 1;
  const auto knot = std::ranges::upper_bound(first, sample) - first.begin() - 1;
  const auto k = static_cast<std::size_t>(knot);
  return Place{k, sample - first[k], time_s - times[sample]};
}

template <class T, class Visitor>
void SwarmProblem::visit(const SwarmState& state, Visitor& visitor) const {
  SwarmWalk<T> walk(*this, state);
  std::vector<std::size_t> next_sighting(robots(), 0);
  std::vector<std::size_t> next_range(robots(), 0);
  // Readings of one robot are in the order of time, so a cursor finds those of an interval.
  const auto each = [&](std::size_t k, std::size_t robot, const auto& readings, std::size_t& cursor,
                        double shift, const auto& is_skipped, const auto& show) {
    for (; cursor < readings.size(); ++cursor) {
      const double stamp_s = seconds(readings[cursor].stamp) + shift;
      const auto place = place_of(robot, stamp_s);
      if (!place) {
        if (stamp_s < 0.0 || stamp_s < imu_s_[robot][first_sample_[robot][k]]) continue;
        return;
      }
      if (place->knot > k) return;
      const double common_s = state.robots[robot].common_s(stamp_s);
      const auto [other, measured] = [&] {
        if constexpr (requires { readings[cursor].board; }) {
          return std::pair(readings[cursor].board, readings[cursor].uv);
        } else {
          return std::pair(readings[cursor].other, readings[cursor].range_m);
        }
      }();
      const auto other_place = place_of(other, state.robots[other].stamp_s(common_s));
      if (!other_place) continue;
      if (is_skipped(cursor)) continue;
      const Reading reading{robot,   other,   cursor, place->knot, other_place->knot,
                            stamp_s, common_s};
      show(reading, walk.at(robot, *place), walk.at(other, *other_place), measured);
    }
  };
  for (std::size_t k = 0; k + 1 < knots(); ++k) {
    for (std::size_t pair = 0; pair < pair_noise_.size(); ++pair) {
      const RangeNoise& noise = pair_noise_[pair];
      const double decay =
          std::exp(-to_seconds(time_of(0, k + 1) - time_of(0, k)) / noise.bias_time_s);
      visitor.drift(k, pair, decay, noise.bias_drift_m * std::sqrt(1.0 - decay * decay));
    }
    for (std::size_t r = 0; r < robots(); ++r) {
      const double dt = imu_s_[r][first_sample_[r][k + 1]] - imu_s_[r][first_sample_[r][k]];
      visitor.imu(r, k, walk.interval(r, k), knot_whitening(records_[r].noise, dt));
      each(
          k, r, records_[r].sightings, next_sighting[r], state.robots[r].camera.shift_s,
          [&](std::size_t i) { return !visitor.wants(weights_.sightings[r][i]); },
          [&](const Reading& reading, const auto& from, const auto& to, const auto& uv) {
            visitor.sighting(reading, from, to, uv, sigma_px_[r],
                             weights_.sightings[r][reading.index]);
          });
      each(
          k, r, records_[r].ranges, next_range[r], 0.0,
          [&](std::size_t i) { return !visitor.wants(weights_.ranges[r][i]); },
          [&](const Reading& reading, const auto& from, const auto& to, double range_m) {
            visitor.range(reading, from, to, range_m, sigma_m_, weights_.ranges[r][reading.index]);
          });
    }
  }
}

/// Heading and position of the first robot's first knot are free, and so is the common clock.
template <class Visitor>
void SwarmProblem::visit_priors(const SwarmState& state, const SwarmState& prior,
                                Visitor& visitor) const {
  for (std::size_t r = 0; r < robots(); ++r) {
    RobotPriors sigma = priors_[r];
    if (r == 0) sigma.tail<2>() << kClockGauge_s, kSkewGauge;
    const RobotPriors d = difference(prior.robots[r], state.robots[r]);
    for (int i = 0; i < at::kSize; ++i)
      visitor.prior_of_constant(constants_at(r) + i, d(i) / sigma(i), 1.0 / sigma(i));
    const CameraKnot& first = state.knots[r].front();
    const auto add = [&](int column, const Eigen::Vector3d& error, double sigma_of_axis) {
      for (int i = 0; i < 3; ++i) {
        visitor.prior_of_first(body_at(r) + column, Eigen::RowVector3d::Unit(i) / sigma_of_axis,
                               error[i] / sigma_of_axis);
      }
    };
    add(9, first.gyro_bias, records_[r].noise.gyroscope_bias_sigma);
    add(12, first.accel_bias, records_[r].noise.accelerometer_bias_sigma);
    if (r > 0) continue;
    for (std::size_t pair = 0; pair < pair_noise_.size(); ++pair) {
      const RangeNoise& noise = pair_noise_[pair];
      visitor.prior_of_constant(constants_at(robots()) + static_cast<int>(pair),
                                state.pair_bias_m[pair] / noise.bias_sigma_m,
                                1.0 / noise.bias_sigma_m);
      visitor.prior_of_drift(pair, state.pair_drift_m.front()[pair] / noise.bias_drift_m,
                             1.0 / noise.bias_drift_m);
    }
    const CameraKnot& held = prior.knots[r].front();
    add(3, first.v_W, kVelocitySigma);
    add(6, first.p_W - held.p_W, kGaugeSigma);
    const Eigen::Vector3d turned = first.q_W_B * so3_log(held.q_W_B.conjugate() * first.q_W_B);
    visitor.prior_of_first(body_at(r), first.q_W_B.toRotationMatrix().row(2) / kGaugeSigma,
                           turned.z() / kGaugeSigma);
  }
}

double SwarmProblem::cost(const SwarmState& state, const SwarmState& prior) const {
  PlainVisitor visitor(state, nullptr);
  visit<double>(state, visitor);
  visit_priors(state, prior, visitor);
  return visitor.sum();
}

TeamArrowSystem SwarmProblem::linearize(const SwarmState& state, const SwarmState& prior) const {
  const auto count = static_cast<int>(robots());
  const auto pairs = static_cast<int>(pair_count(robots()));
  TeamArrowSystem system(knots(), at::kSize * count + pairs, kBody * count + pairs);
  LinearVisitor visitor(state, system);
  visit<TimeJet>(state, visitor);
  visitor.finish();
  visit_priors(state, prior, visitor);
  return system;
}

SwarmResiduals SwarmProblem::residuals(const SwarmState& state) const {
  SwarmResiduals residuals;
  for (const RobotRecord& record : records_) {
    residuals.sightings.emplace_back(record.sightings.size());
    residuals.ranges.emplace_back(record.ranges.size(), std::numeric_limits<double>::quiet_NaN());
  }
  PlainVisitor visitor(state, &residuals);
  visit<double>(state, visitor);
  return residuals;
}

}  // namespace crepes
