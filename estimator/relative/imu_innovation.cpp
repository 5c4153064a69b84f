#include "estimator/relative/imu_innovation.hpp"

#include <algorithm>
#include <span>

#include "estimator/core/quantile.hpp"

namespace crepes {
namespace {

constexpr double kMostSteps = 10.0;  // over which an innovation grows as a random walk
constexpr Duration kTypicalPeriod = std::chrono::milliseconds{10};

ImuSample extrapolated(const ImuSample& before, const ImuSample& last, double steps) {
  return {last.stamp, last.gyro_radps + steps * (last.gyro_radps - before.gyro_radps),
          last.accel_mps2 + steps * (last.accel_mps2 - before.accel_mps2)};
}

}  // namespace

PerSensor largest(const PerSensor& a, const PerSensor& b) {
  return {std::max(a.gyro, b.gyro), std::max(a.accel, b.accel)};
}

bool is_within(const PerSensor& size, const PerSensor& most) {
  return size.gyro <= most.gyro && size.accel <= most.accel;
}

PerSensor distance(const ImuSample& a, const ImuSample& b) {
  return {(a.gyro_radps - b.gyro_radps).norm(), (a.accel_mps2 - b.accel_mps2).norm()};
}

double ImuReference::steps_to(Timestamp stamp) const {
  const Duration period = before ? last.stamp - before->stamp : kTypicalPeriod;
  return std::min(to_seconds(stamp - last.stamp) / to_seconds(period), kMostSteps);
}

PerSensor innovation(const ImuSample& sample, const ImuReference& reference) {
  const PerSensor constant = distance(sample, reference.last);
  if (!reference.before) return constant;
  const double steps = reference.steps_to(sample.stamp);
  const PerSensor linear = distance(sample, extrapolated(*reference.before, reference.last, steps));
  return {std::min(constant.gyro, linear.gyro), std::min(constant.accel, linear.accel)};
}

void InnovationScale::add(double size) {
  sizes_.at(count_++ % kKept) = size;
  const std::size_t n = std::min(count_, kKept);
  if (n < kLeast) return;
  std::array<double, kKept> sorted = sizes_;
  median_ = upper_median(std::span(sorted).first(n));
  is_known_ = true;
}

}  // namespace crepes
