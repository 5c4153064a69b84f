#include "estimator/calibration/swarm/swarm_problem.hpp"

#include <ceres/jet.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <type_traits>
#include <utility>

#include "estimator/calibration/batch/knot_noise.hpp"
#include "estimator/calibration/swarm/body_interval.hpp"
#include "estimator/calibration/swarm/swarm_cost.hpp"
#include "estimator/calibration/swarm/swarm_linearization.hpp"
#include "estimator/calibration/swarm/swarm_reading.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

constexpr double kShortestSpacing_s = 0.02;
constexpr double kLongestSpacing_s = 0.1;
constexpr double kUsualRobots = 4.0;
constexpr double kGaugeSigma = 1e-4;    // position and heading of the first robot: free to choose
constexpr double kClockGauge_s = 1e-6;  // of the first robot's clock
constexpr double kSkewGauge = 1e-8;
constexpr double kVelocitySigma = 3.0;  // of the first knots [m/s]
constexpr double kLeastBias_m = 1e-3;

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

/// The readings of one kind by one robot, in the order of time, so that a cursor finds those of an
/// interval.
template <class Reading>
struct ReadingCursor {
  std::size_t robot = 0;
  std::span<const Reading> readings;
  std::span<const double> weights;
  double sigma = 0.0;
  double shift_s = 0.0;  ///< added to their stamps
  std::size_t next = 0;
};

std::size_t other_of(const BoardSighting& sighting) { return sighting.board; }
std::size_t other_of(const RobotRange& range) { return range.other; }

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

  /// Shows the readings of the interval that begins at `knot`, after those before.
  template <class Reading, class Visitor>
  void show_readings(std::size_t knot, ReadingCursor<Reading>& cursor, Visitor& visitor) {
    const std::size_t robot = cursor.robot;
    const double begin_s = problem_.imu_s_[robot][problem_.first_sample_[robot][knot]];
    for (; cursor.next < cursor.readings.size(); ++cursor.next) {
      const Reading& read = cursor.readings[cursor.next];
      const double weight = cursor.weights[cursor.next];
      const double stamp_s = problem_.seconds(read.stamp) + cursor.shift_s;
      const auto place = problem_.place_of(robot, stamp_s);
      if (!place && (stamp_s < 0.0 || stamp_s < begin_s)) continue;
      if (!place || place->knot > knot) return;
      const double common_s = state_.robots[robot].common_s(stamp_s);
      const std::size_t other = other_of(read);
      const auto other_place = problem_.place_of(other, state_.robots[other].stamp_s(common_s));
      if (!other_place || !visitor.wants(weight)) continue;
      const SwarmReading reading{robot,   other,   cursor.next, place->knot, other_place->knot,
                                 stamp_s, common_s};
      const BodyPlace<T> from = at(robot, *place);
      const BodyPlace<T> to = at(other, *other_place);
      if constexpr (std::is_same_v<Reading, BoardSighting>) {
        visitor.sighting(reading, from, to, read.uv, cursor.sigma, weight);
      } else {
        visitor.range(reading, from, to, read.range_m, cursor.sigma, weight);
      }
    }
  }

 private:
  BodyPlace<T> at(std::size_t robot, const SwarmProblem::Place& place) {
    return interval(robot, place.knot)
        .at(place.step, seeded<T>(place.tau, interval_columns::kTime));
  }

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
  const bool is_inside = time_s >= times[first.front()] && time_s < times[first.back()];
  if (!is_inside) return std::nullopt;  // not a number, too
  const auto next = std::ranges::upper_bound(times, time_s);
  const auto sample = static_cast<std::size_t>(next - times.begin()) - 1;
  const auto knot = std::ranges::upper_bound(first, sample) - first.begin() - 1;
  const auto k = static_cast<std::size_t>(knot);
  return Place{k, sample - first[k], time_s - times[sample]};
}

/// Shows all drifts, intervals and readings to a `SwarmCost` or a `SwarmLinearization`, interval by
/// interval.
template <class T, class Visitor>
void SwarmProblem::visit(const SwarmState& state, Visitor& visitor) const {
  SwarmWalk<T> walk(*this, state);
  std::vector<ReadingCursor<BoardSighting>> sightings;
  std::vector<ReadingCursor<RobotRange>> ranges;
  for (std::size_t r = 0; r < robots(); ++r) {
    sightings.push_back({.robot = r,
                         .readings = records_[r].sightings,
                         .weights = weights_.sightings[r],
                         .sigma = sigma_px_[r],
                         .shift_s = state.robots[r].camera.shift_s});
    ranges.push_back({.robot = r,
                      .readings = records_[r].ranges,
                      .weights = weights_.ranges[r],
                      .sigma = sigma_m_});
  }
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
      walk.show_readings(k, sightings[r], visitor);
      walk.show_readings(k, ranges[r], visitor);
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
    for (int i = 0; i < swarm_constants::kSize; ++i)
      visitor.prior_of_constant(constants_index(r) + i, d(i) / sigma(i), 1.0 / sigma(i));
    const CameraKnot& first = state.knots[r].front();
    const auto add = [&](int column, const Eigen::Vector3d& error, double sigma_of_axis) {
      for (int i = 0; i < 3; ++i) {
        visitor.prior_of_first(body_index(r) + column, Eigen::RowVector3d::Unit(i) / sigma_of_axis,
                               error[i] / sigma_of_axis);
      }
    };
    add(9, first.gyro_bias, records_[r].noise.gyroscope_bias_sigma);
    add(12, first.accel_bias, records_[r].noise.accelerometer_bias_sigma);
    if (r > 0) continue;
    for (std::size_t pair = 0; pair < pair_noise_.size(); ++pair) {
      const RangeNoise& noise = pair_noise_[pair];
      visitor.prior_of_constant(constants_index(robots()) + static_cast<int>(pair),
                                state.pair_bias_m[pair] / noise.bias_sigma_m,
                                1.0 / noise.bias_sigma_m);
      visitor.prior_of_drift(pair, state.pair_drift_m.front()[pair] / noise.bias_drift_m,
                             1.0 / noise.bias_drift_m);
    }
    const CameraKnot& held = prior.knots[r].front();
    add(3, first.v_W, kVelocitySigma);
    add(6, first.p_W - held.p_W, kGaugeSigma);
    const Eigen::Vector3d turned = first.q_W_B * so3_log(held.q_W_B.conjugate() * first.q_W_B);
    visitor.prior_of_first(body_index(r), first.q_W_B.toRotationMatrix().row(2) / kGaugeSigma,
                           turned.z() / kGaugeSigma);
  }
}

double SwarmProblem::cost(const SwarmState& state, const SwarmState& prior) const {
  SwarmCost visitor(state, nullptr);
  visit<double>(state, visitor);
  visit_priors(state, prior, visitor);
  return visitor.sum();
}

TeamArrowSystem SwarmProblem::linearize(const SwarmState& state, const SwarmState& prior) const {
  const auto pairs = static_cast<int>(pair_count(robots()));
  TeamArrowSystem system(knots(), constants_index(robots()) + pairs, body_index(robots()) + pairs);
  SwarmLinearization visitor(state, system);
  visit<IntervalJet>(state, visitor);
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
  SwarmCost visitor(state, &residuals);
  visit<double>(state, visitor);
  return residuals;
}

}  // namespace crepes
