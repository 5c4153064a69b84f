#include "estimator/calibration/swarm/swarm_cost.hpp"

#include "estimator/calibration/swarm/swarm_factors.hpp"

namespace crepes {
namespace {

constexpr double kInvalidCost_px = 200.0;  // what a sighting costs that the lens cannot show

BodyAt plain(const BodyPlace<double>& place) {
  return {Eigen::Quaterniond(place.R_W_B), place.p_W};
}

}  // namespace

void SwarmCost::imu(std::size_t robot, std::size_t knot, const BodyInterval<double>& interval,
                    const ArrowSystem::StateMatrix& L) {
  const CameraKnot& next = state_.knots[robot][knot + 1];
  ArrowSystem::StateVector r;
  const Motion<double>& end = interval.end();
  r << small_log<double>(end.R_W_B.transpose() * next.q_W_B.toRotationMatrix()), next.v_W - end.v_W,
      next.p_W - end.p_W, next.gyro_bias - interval.gyro_bias(),
      next.accel_bias - interval.accel_bias();
  sum_ += 0.5 * (L * r).squaredNorm();
}

void SwarmCost::sighting(const SwarmReading& reading, const BodyPlace<double>& from,
                         const BodyPlace<double>& to, const Eigen::Vector2d& uv, double sigma,
                         double weight) {
  const auto seen = predicted_spot(state_.robots[reading.observer], plain(from),
                                   state_.robots[reading.other], plain(to));
  const Eigen::Vector2d r = seen ? Eigen::Vector2d(*seen - uv) : Eigen::Vector2d::Zero();
  const double square = seen ? r.squaredNorm() : kInvalidCost_px * kInvalidCost_px;
  sum_ += 0.5 * weight * square / (sigma * sigma);
  if (residuals_ != nullptr)
    residuals_->sightings[reading.observer][reading.index] = {r, seen.has_value()};
}

void SwarmCost::range(const SwarmReading& reading, const BodyPlace<double>& from,
                      const BodyPlace<double>& to, double range_m, double sigma, double weight) {
  const auto factor = linearize_antenna_range(state_.robots[reading.observer], plain(from),
                                              state_.robots[reading.other], plain(to));
  if (!factor) return;
  const double r = range_m - factor->range_m - pair_part_m(state_, reading);
  sum_ += 0.5 * weight * r * r / (sigma * sigma);
  if (residuals_ != nullptr) residuals_->ranges[reading.observer][reading.index] = r;
}

void SwarmCost::drift(std::size_t knot, std::size_t pair, double decay, double sigma) {
  const double r = state_.pair_drift_m[knot + 1][pair] - decay * state_.pair_drift_m[knot][pair];
  sum_ += 0.5 * r * r / (sigma * sigma);
}

}  // namespace crepes
