#include "estimator/relative/imu_history.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/core/contract.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

constexpr double kNoiseShare =
    0.02;  // of one sample in the smoothed noise: half a second at 100 Hz
constexpr Duration kRotationStep = std::chrono::milliseconds{5};

void add(const ImuSample& sample, double dt, bool guessed, ImuMean& sum) {
  sum.gyro_radps += dt * sample.gyro_radps;
  sum.accel_mps2 += dt * sample.accel_mps2;
  if (guessed) sum.guessed += dt;
}

}  // namespace

bool is_plausible(const ImuSample& sample) {
  // Written so that NaN is not.
  return (sample.gyro_radps.array().abs() <= 100.0).all() &&
         (sample.accel_mps2.array().abs() <= 1000.0).all();
}

std::size_t ImuHistory::first_after(Timestamp t) const {
  std::size_t low = 0;
  std::size_t high = size_;
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if ((*this)[middle].stamp <= t) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

bool ImuHistory::push(const ImuSample& sample) {
  if (!is_plausible(sample)) return false;
  std::size_t place = first_after(sample.stamp);
  if (place > 0 && (*this)[place - 1].stamp == sample.stamp) return false;
  if (size_ == kCapacity) {
    if (place == 0) return false;
    first_ = (first_ + 1) % kCapacity;
    --size_;
    --place;
  }
  ++size_;
  for (std::size_t i = size_ - 1; i > place; --i) slot(i) = (*this)[i - 1];
  slot(place) = sample;
  if (place + 1 == size_) observe_noise();
  return true;
}

// White noise of variance s^2 has second differences of variance 6 s^2, on each of three axes.
void ImuHistory::observe_noise() {
  if (size_ < 3) return;
  const ImuSample& a = (*this)[size_ - 3];
  const ImuSample& b = (*this)[size_ - 2];
  const ImuSample& c = newest();
  if (c.stamp - a.stamp > kMaxGap) return;
  const double scale = 0.5 * to_seconds(c.stamp - a.stamp) / 18.0;
  const auto observe = [&](const auto& second_difference, double& density2) {
    density2 += kNoiseShare * (scale * second_difference.squaredNorm() - density2);
  };
  observe(c.gyro_radps - 2.0 * b.gyro_radps + a.gyro_radps, gyro_density2_);
  observe(c.accel_mps2 - 2.0 * b.accel_mps2 + a.accel_mps2, accel_density2_);
}

ImuMean ImuHistory::mean(Timestamp from, Timestamp to) const {
  CREPES_EXPECT(size_ > 0 && from < to, "mean over an interval with samples");
  ImuMean sum;
  Timestamp t = from;
  for (std::size_t i = first_after(from); i < size_ && t < to; ++i) {
    const ImuSample& sample = (*this)[i];
    const bool covered = i > 0 && sample.stamp - (*this)[i - 1].stamp <= kMaxGap;
    const Timestamp end = std::min(to, sample.stamp);
    add(sample, to_seconds(end - t), !covered, sum);
    t = end;
  }
  if (t < to) add(newest(), to_seconds(to - t), true, sum);

  const double width = to_seconds(to - from);
  return {.gyro_radps = sum.gyro_radps / width,
          .accel_mps2 = sum.accel_mps2 / width,
          .guessed = sum.guessed / width,
          .gyro_density = std::sqrt(gyro_density2_),
          .accel_density = std::sqrt(accel_density2_)};
}

Eigen::Quaterniond ImuHistory::rotation(Timestamp from, Timestamp to) const {
  if (to < from) return rotation(to, from).conjugate();
  Eigen::Quaterniond q_from_to = Eigen::Quaterniond::Identity();
  for (Timestamp t = from; t < to;) {
    const Timestamp next = std::min(to, t + kRotationStep);
    q_from_to = q_from_to * so3_exp(mean(t, next).gyro_radps * to_seconds(next - t));
    t = next;
  }
  return q_from_to.normalized();
}

}  // namespace crepes
