#include "estimator/core/imu_history.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/core/contract.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

// An accelerometer's bias moves with the vibration that it rectifies: one sigma of that, over the
// density of the vibration [m/s^2 / (m/s^2/sqrt(Hz))]. 0.15 m/s^2, that is 15 mg, for rotors that
// shake it by 2.5 m/s^2 at 100 samples a second.
constexpr double kBiasByVibration = 0.6;
constexpr Duration kRotationStep = std::chrono::milliseconds{5};
constexpr std::int64_t kMaxRotationSteps = 400;  // longer intervals are cut into longer steps

void add(const ImuSample& sample, double dt, ImuMean& sum) {
  sum.gyro_radps += dt * sample.gyro_radps;
  sum.accel_mps2 += dt * sample.accel_mps2;
}

// Adds a time that no sample covers, which begins `since` seconds from the nearest one.
void extrapolate(double since, double dt, ImuMean& sum) {
  const double most = to_seconds(ImuHistory::kMaxHold);
  const double end = std::min(since + dt, most);
  const double begin = std::min(since, most);
  sum.extrapolated += dt;
  sum.extrapolation_time2_s2 +=
      (end * end * end - begin * begin * begin) / 3.0 + most * most * (dt - (end - begin));
}

// The larger ones hold for all of an interval.
void raise_densities(double gyro, double accel, ImuMean& sum) {
  sum.gyro_innovation_density = std::max(sum.gyro_innovation_density, gyro);
  sum.accel_innovation_density = std::max(sum.accel_innovation_density, accel);
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

bool ImuHistory::push(const ImuSample& sample, const Eigen::Vector3d& blow_mps,
                      const Eigen::Vector3d& turn_rad) {
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
  for (std::size_t i = size_ - 1; i > place; --i) slot(i) = slot(i - 1);
  slot(place) = {sample, blow_mps, turn_rad};
  if (place + 1 == size_) observe_motion();
  return true;
}

template <class Samples>
std::optional<ImuHistory::Recent<Samples>> ImuHistory::recent() const {
  constexpr int kSamples = Samples::ColsAtCompileTime;
  if (size_ < kSamples) return std::nullopt;
  const Duration span = newest().stamp - (*this)[size_ - kSamples].stamp;
  const Duration pace = span / (kSamples - 1);
  if (pace > kMaxGap) return std::nullopt;
  Recent<Samples> recent{.gyro = {}, .accel = {}, .period_s = to_seconds(pace)};
  for (int back = 0; back < kSamples; ++back) {
    const std::size_t i = size_ - 1 - static_cast<std::size_t>(back);
    if (back > 0 && (*this)[i + 1].stamp - (*this)[i].stamp > 2 * pace) return std::nullopt;
    recent.gyro.col(back) = (*this)[i].gyro_radps;
    recent.accel.col(back) = (*this)[i].accel_mps2;
  }
  return recent;
}

void ImuHistory::observe_motion() {
  if (const auto samples = recent<SignalModel::Past>()) {
    gyro_.observe(samples->gyro, samples->period_s);
    accel_.observe(samples->accel, samples->period_s);
    const double noise2 = SignalModel::newest_noise_density2(samples->accel, samples->period_s);
    slot(size_ - 1).bias_variance_m2ps4 =
        std::pow(kBiasByVibration, 2) * vibration_.observe(noise2);
  }
}

// The newest sample is the mean since the one before, so it is the value in the middle of that
// time.
double ImuHistory::strides_to(Timestamp from, Timestamp to, double period_s) const {
  const double since = 0.5 * (to_seconds(from - newest().stamp) + to_seconds(to - newest().stamp));
  return std::max(0.0, since / period_s + 0.5) / SignalModel::kStride;
}

void ImuHistory::add_held(const ImuSample& sample, double dt, ImuMean& sum) const {
  add(sample, dt, sum);
  raise_densities(gyro_.hold_density(), accel_.hold_density(), sum);
}

void ImuHistory::add_bridge(std::size_t after, Timestamp from, Timestamp to, ImuMean& sum) const {
  const ImuSample& first = (*this)[after - 1];
  const ImuSample& last = (*this)[after];
  const Timestamp middle = first.stamp + (last.stamp - first.stamp) / 2;
  const Timestamp turn = std::clamp(middle, from, to);
  extrapolate(to_seconds(from - first.stamp), to_seconds(turn - from), sum);
  extrapolate(to_seconds(last.stamp - to), to_seconds(to - turn), sum);
  const double dt = to_seconds(to - from);
  const double part = 0.5 * (to_seconds(from - first.stamp) + to_seconds(to - first.stamp)) /
                      to_seconds(last.stamp - first.stamp);
  add_held(first, (1.0 - part) * dt, sum);
  add_held(last, part * dt, sum);
}

// The prediction is limited to the horizons for which there are weights.
void ImuHistory::add_predicted(Timestamp from, Timestamp to, ImuMean& sum) const {
  const double dt = to_seconds(to - from);
  extrapolate(to_seconds(from - newest().stamp), dt, sum);
  const auto samples = recent<SignalModel::Window>();
  if (!samples) return add_held(newest(), dt, sum);
  add(newest(), dt, sum);
  const double strides = strides_to(from, to, samples->period_s);
  sum.gyro_radps += dt * gyro_.change_after(strides, samples->gyro);
  sum.accel_mps2 += dt * accel_.change_after(strides, samples->accel);
  raise_densities(gyro_.innovation_density(strides), accel_.innovation_density(strides), sum);
}

ImuMean ImuHistory::mean(Timestamp from, Timestamp to) const {
  CREPES_EXPECT(size_ > 0 && from < to, "mean over an interval with samples");
  ImuMean sum;
  Timestamp t = from;
  for (std::size_t i = first_after(from); i < size_ && t < to; ++i) {
    const ImuSample& sample = (*this)[i];
    const Timestamp end = std::min(to, sample.stamp);
    const double dt = to_seconds(end - t);
    if (i == 0) {
      extrapolate(to_seconds(sample.stamp - end), dt, sum);
      add_held(sample, dt, sum);
    } else if (sample.stamp - (*this)[i - 1].stamp > kMaxGap) {
      add_bridge(i, t, end, sum);
    } else {
      add(sample, dt, sum);
    }
    const bool is_unsteady = !kept(i).blow_mps.isZero() || !kept(i).turn_rad.isZero() ||
                             kept(i).bias_variance_m2ps4 > 0.0;
    if (i > 0 && is_unsteady) {
      const double share = dt / to_seconds(sample.stamp - (*this)[i - 1].stamp);
      sum.blow_variance_m2ps2 += share * kept(i).blow_mps.cwiseAbs2();
      sum.turn_variance_rad2 += share * kept(i).turn_rad.cwiseAbs2();
      sum.bias_variance_m2ps4 += share * kept(i).bias_variance_m2ps4;
    }
    t = end;
  }
  if (t < to) add_predicted(t, to, sum);

  const double width = to_seconds(to - from);
  return {.gyro_radps = sum.gyro_radps / width,
          .accel_mps2 = sum.accel_mps2 / width,
          .extrapolated = sum.extrapolated / width,
          .extrapolation_time2_s2 = sum.extrapolation_time2_s2 / width,
          .gyro_noise_density = gyro_.noise_density(),
          .accel_noise_density = accel_.noise_density(),
          .gyro_innovation_density = sum.gyro_innovation_density,
          .accel_innovation_density = sum.accel_innovation_density,
          .blow_variance_m2ps2 = sum.blow_variance_m2ps2,
          .turn_variance_rad2 = sum.turn_variance_rad2,
          .bias_variance_m2ps4 = sum.bias_variance_m2ps4};
}

Duration ImuHistory::extrapolated(Timestamp from, Timestamp to) const {
  if (from == to) return Duration{0};
  const auto [first, last] = std::minmax(from, to);
  return from_seconds(mean(first, last).extrapolated * to_seconds(last - first));
}

Eigen::Quaterniond ImuHistory::rotation(Timestamp from, Timestamp to) const {
  if (to < from) return rotation(to, from).conjugate();
  Eigen::Quaterniond q_from_to = Eigen::Quaterniond::Identity();
  const Duration step = std::max(kRotationStep, (to - from) / kMaxRotationSteps);
  for (Timestamp t = from; t < to;) {
    const Timestamp next = std::min(to, t + step);
    q_from_to = q_from_to * so3_exp(mean(t, next).gyro_radps * to_seconds(next - t));
    t = next;
  }
  return q_from_to.normalized();
}

}  // namespace crepes
