#include "estimator/relative/imu_blow.hpp"

#include <utility>

#include "estimator/relative/imu_innovation.hpp"

namespace crepes {
namespace {

// The change of a robot's speed by a blow, an axis. A robot that hits a wall at 0.5 m/s and is
// thrown back changes by as much.
constexpr double kHardestBlow = 1.0;  // m/s

constexpr std::size_t kTooMany = ImuBlow::kLongest + 1;

}  // namespace

void ImuBlow::add(const ImuSample& refused, const ImuSample& last) {
  if (count_ >= kLongest) {
    by_refused_mps_.setZero();
    count_ = kTooMany;
    return;
  }
  const ImuSample& before = count_ > 0 ? refused_.at(count_ - 1) : last;
  by_refused_mps_ +=
      to_seconds(refused.stamp - before.stamp) * (refused.accel_mps2 - last.accel_mps2);
  refused_.at(count_++) = refused;
}

void ImuBlow::end(const ImuSample& after, const ImuSample& last, double reachable_radps) {
  if (!by_refused_mps_.isZero()) {
    velocity_until_ = after.stamp;
    velocity_mps_ = by_refused_mps_.cwiseMax(-kHardestBlow).cwiseMin(kHardestBlow);
    by_refused_mps_.setZero();
  }
  if (count_ > 0) keep_rates(after, last, reachable_radps);
}

void ImuBlow::keep_rates(const ImuSample& after, const ImuSample& last, double reachable_radps) {
  rate_count_ = 0;
  rates_until_ = after.stamp;
  const std::size_t count = std::exchange(count_, 0);
  if (count == kTooMany) return;
  const double duration_s = to_seconds(after.stamp - last.stamp);
  ImuSample before = last;
  for (const ImuSample& sample : std::span(refused_).first(count)) {
    if (distance(sample, before).gyro > reachable_radps) continue;
    const double share = to_seconds(sample.stamp - last.stamp) / duration_s;
    const Eigen::Vector3d expected = last.gyro_radps + share * (after.gyro_radps - last.gyro_radps);
    const double dt = to_seconds(sample.stamp - std::exchange(before, sample).stamp);
    rates_.at(rate_count_++) = {.sample = {sample.stamp, sample.gyro_radps, last.accel_mps2},
                                .turn_rad = dt * (sample.gyro_radps - expected)};
  }
}

void ImuBlow::forget() {
  count_ = 0;
  by_refused_mps_.setZero();
}

Eigen::Vector3d ImuBlow::velocity_mps(const ImuSample& believed) const {
  return believed.stamp == velocity_until_ ? velocity_mps_ : Eigen::Vector3d::Zero();
}

std::span<const KeptRate> ImuBlow::rates_before(const ImuSample& believed) const {
  return {rates_.data(), believed.stamp == rates_until_ ? rate_count_ : 0};
}

}  // namespace crepes
