#include "estimator/relative/imu_history.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/core/contract.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

constexpr double kNoiseShare = 0.02;       // of one sample in the smoothed noise: 0.5 s at 100 Hz
constexpr double kMeanTime = 3.0;          // s
constexpr std::size_t kChangeSamples = 3;  // about as long as a peer's samples are late
constexpr Duration kRotationStep = std::chrono::milliseconds{5};

void add(const ImuSample& sample, double dt, ImuMean& sum) {
  sum.gyro_radps += dt * sample.gyro_radps;
  sum.accel_mps2 += dt * sample.accel_mps2;
}

// Integral of the square of the time since the last sample, from `since` on and for `dt`.
double held(double since, double dt) {
  const double most = to_seconds(ImuHistory::kMaxHold);
  const double end = std::min(since + dt, most);
  const double begin = std::min(since, most);
  return (end * end * end - begin * begin * begin) / 3.0 + most * most * (dt - (end - begin));
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
  if (place + 1 == size_) observe_motion();
  return true;
}

// White noise of variance s^2 has second differences of variance 6 s^2, on each of three axes.
void ImuHistory::observe_motion() {
  if (size_ == 1) accel_mean_ = newest().accel_mps2;
  if (size_ < 3) return;
  const ImuSample& a = (*this)[size_ - 3];
  const ImuSample& b = (*this)[size_ - 2];
  const ImuSample& c = newest();
  if (c.stamp - a.stamp > kMaxGap) return;
  const double period = 0.5 * to_seconds(c.stamp - a.stamp);
  const auto smooth = [](double value, double& mean) { mean += kNoiseShare * (value - mean); };
  const auto observe = [&](const auto& second_difference, double& density2) {
    smooth(period * second_difference.squaredNorm() / 18.0, density2);
  };
  observe(c.gyro_radps - 2.0 * b.gyro_radps + a.gyro_radps, gyro_density2_);
  observe(c.accel_mps2 - 2.0 * b.accel_mps2 + a.accel_mps2, accel_density2_);
  accel_mean_ += std::min(1.0, period / kMeanTime) * (c.accel_mps2 - accel_mean_);

  if (size_ <= kChangeSamples) return;
  const ImuSample& before = (*this)[size_ - 1 - kChangeSamples];
  const double apart = to_seconds(c.stamp - before.stamp);
  if (apart > static_cast<double>(kChangeSamples) * to_seconds(kMaxGap)) return;
  smooth((c.gyro_radps - before.gyro_radps).squaredNorm() / 3.0 / apart, gyro_change2_);
  smooth((c.accel_mps2 - before.accel_mps2).squaredNorm() / 3.0 / apart, accel_change2_);
  noise_share_ = 2.0 / (apart * period);
}

ImuMean ImuHistory::mean(Timestamp from, Timestamp to) const {
  CREPES_EXPECT(size_ > 0 && from < to, "mean over an interval with samples");
  ImuMean sum;
  const auto guess = [&](double since, double dt) {
    sum.guessed += dt;
    sum.held_s2 += held(since, dt);
  };
  Timestamp t = from;
  for (std::size_t i = first_after(from); i < size_ && t < to; ++i) {
    const ImuSample& sample = (*this)[i];
    const bool covered = i > 0 && sample.stamp - (*this)[i - 1].stamp <= kMaxGap;
    const Timestamp end = std::min(to, sample.stamp);
    const double dt = to_seconds(end - t);
    add(sample, dt, sum);
    if (!covered) guess(to_seconds(kMaxHold), dt);
    t = end;
  }
  if (t < to) {
    const double dt = to_seconds(to - t);
    add(newest(), dt, sum);
    guess(to_seconds(t - newest().stamp), dt);
  }

  const double width = to_seconds(to - from);
  const Eigen::Vector3d accel_mps2 = sum.accel_mps2 / width;
  // A change of white noise alone has variance 2 s^2.
  const auto change = [this](double change2, double density2) {
    return std::sqrt(std::max(0.0, change2 - noise_share_ * density2));
  };
  return {.gyro_radps = sum.gyro_radps / width,
          .accel_mps2 = accel_mps2,
          .guessed = sum.guessed / width,
          .held_s2 = sum.held_s2 / width,
          .gyro_density = std::sqrt(gyro_density2_),
          .accel_density = std::sqrt(accel_density2_),
          .gyro_change = change(gyro_change2_, gyro_density2_),
          .accel_change = change(accel_change2_, accel_density2_),
          .accel_swing_mps2 = (accel_mps2 - accel_mean_).norm()};
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
