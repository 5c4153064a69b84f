#include "estimator/relative/imu_history.hpp"

#include <algorithm>

#include "estimator/core/contract.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

constexpr Duration kRotationStep = std::chrono::milliseconds{5};

// Adds the integral of a linear signal from `a` to `b`, cut to [from, to].
void add_linear(const ImuSample& a, const ImuSample& b, Timestamp from, Timestamp to,
                ImuMean& sum) {
  const Timestamp begin = std::max(from, a.stamp);
  const Timestamp end = std::min(to, b.stamp);
  if (begin >= end) return;
  const double width = to_seconds(b.stamp - a.stamp);
  const double middle = 0.5 * (to_seconds(begin - a.stamp) + to_seconds(end - a.stamp)) / width;
  const double dt = to_seconds(end - begin);
  sum.gyro_radps += dt * ((1.0 - middle) * a.gyro_radps + middle * b.gyro_radps);
  sum.accel_mps2 += dt * ((1.0 - middle) * a.accel_mps2 + middle * b.accel_mps2);
  if (b.stamp - a.stamp > ImuHistory::kMaxGap) sum.guessed += dt;
}

void add_held(const ImuSample& sample, double dt, ImuMean& sum) {
  sum.gyro_radps += dt * sample.gyro_radps;
  sum.accel_mps2 += dt * sample.accel_mps2;
  sum.guessed += dt;
}

}  // namespace

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
  if (!sample.gyro_radps.allFinite() || !sample.accel_mps2.allFinite()) return false;
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
  return true;
}

ImuMean ImuHistory::mean(Timestamp from, Timestamp to) const {
  CREPES_EXPECT(size_ > 0 && from < to, "mean over an interval with samples");
  ImuMean sum;
  if (from < (*this)[0].stamp) {
    add_held((*this)[0], to_seconds(std::min(to, (*this)[0].stamp) - from), sum);
  }
  for (std::size_t i = std::max<std::size_t>(first_after(from), 1); i < size_; ++i) {
    if ((*this)[i - 1].stamp >= to) break;
    add_linear((*this)[i - 1], (*this)[i], from, to, sum);
  }
  if (to > newest().stamp) add_held(newest(), to_seconds(to - std::max(from, newest().stamp)), sum);

  const double width = to_seconds(to - from);
  return {sum.gyro_radps / width, sum.accel_mps2 / width, sum.guessed / width};
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
