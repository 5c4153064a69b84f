#include "estimator/relative/imu_guard.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

// The norm of three normal innovations exceeds eight medians, 12 sigma, never by chance.
constexpr double kMedians = 8.0;
// A change as small as this does no harm within one sample: 1 mrad and 5 mm/s at 100 Hz.
constexpr PerSensor kHarmless{.gyro = 0.1, .accel = 0.5};
// A robot is assumed not to change its rate or its force by more within one sample and keep the new
// value: 200 rad/s^2, and half of gravity within 10 ms.
constexpr PerSensor kLargestChange{.gyro = 2.0, .accel = 5.0};
// Samples after which a change is a vibration that begins, or else, longer than a blow, a jump.
constexpr std::size_t kVibrates = 6;
constexpr std::size_t kJumps = ImuBlow::kLongest;
// Across a longer gap there is no prediction.
constexpr Duration kLongestGap = std::chrono::milliseconds{100};

// After a gap no longer than that, a shock that rings may not have ended.
constexpr Duration kLongestShock = std::chrono::milliseconds{500};

// Medians of innovations: half again the vibration of a sample, which no airframe exceeds.
constexpr PerSensor kMostVibration{.gyro = 3.0, .accel = 30.0};

// Samples after a jump are plausible if they show gravity where it was, and turn as it does.
constexpr double kLeastForce = 0.5 * kGravityMps2;
constexpr double kMostForce = 2.0 * kGravityMps2;
constexpr double kMostTurned = radians(45.0);
constexpr double kMostContradiction = radians(30.0);
constexpr double kMostGrowth = 4.0;  // of the gyroscope's noise, if the accelerometer's is the same
constexpr Duration kOutdated = std::chrono::seconds{5};  // gravity's direction before the jump
constexpr double kForceShare = 0.05;                     // of one sample in the smoothed force

}  // namespace

std::span<const ImuSample> ImuGuard::accept(const ImuSample& sample) {
  believed_count_ = 0;
  const bool is_possible = is_plausible(sample);
  if (is_possible) weigh(sample);
  if (!is_possible || !shows_gravity()) {
    count(ImuFault::kImplausible);
    has_refused_ = true;
  } else if (is_late(sample)) {
    believed_.at(believed_count_++) = sample;
  } else if (!watch_.accept(sample)) {
    count(watch_.is_saturated() ? ImuFault::kSaturated : ImuFault::kHangs);
    drop_held(ImuFault::kJump);
    reference_.reset();
  } else {
    compare(sample);
  }
  return {believed_.data(), believed_count_};
}

/// Adds the sample's force to the mean of the last seconds.
void ImuGuard::weigh(const ImuSample& sample) {
  constexpr double kMemory_s = 2.0;
  if (to_seconds(weighed_ - sample.stamp) > kMemory_s) weighed_ = kNever;  // the clock went back
  if (sample.stamp > weighed_) {
    const double passed_s = to_seconds(sample.stamp - std::exchange(weighed_, sample.stamp));
    const double weight = 1.0 - std::exp(-passed_s / kMemory_s);  // the first sample: 1
    mean_force_ += weight * (sample.accel_mps2.norm() - mean_force_);
  }
}

/// False for samples in another unit: no robot falls freely for seconds, or bears twenty times its
/// weight.
bool ImuGuard::shows_gravity() const {
  constexpr double kLeastMean = 0.3 * kGravityMps2;
  constexpr double kMostMean = 20.0 * kGravityMps2;
  return mean_force_ >= kLeastMean && mean_force_ <= kMostMean;
}

bool ImuGuard::is_late(const ImuSample& sample) const {
  const ImuSample* const last = newest();
  return last != nullptr && sample.stamp <= last->stamp;
}

bool ImuGuard::agrees(const ImuSample& sample, const ImuMean& mean) const {
  const PerSensor change{(sample.gyro_radps - mean.gyro_radps).norm(),
                         (sample.accel_mps2 - mean.accel_mps2).norm()};
  // A late sample fills a gap of several samples, across which the mean is a guess.
  const PerSensor most = largest_change();
  return is_within(change, {2.0 * most.gyro, 2.0 * most.accel});
}

PerSensor ImuGuard::limit() const {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  if (!gyro_.is_known()) return {kNone, kNone};
  return {std::max(kHarmless.gyro, kMedians * gyro_.median()),
          std::max(kHarmless.accel, kMedians * accel_.median())};
}

PerSensor ImuGuard::largest_change() const { return largest(kLargestChange, limit()); }

/// The innovations over their limits.
PerSensor ImuGuard::excess(const ImuSample& sample, const ImuReference& reference) const {
  const PerSensor size = innovation(sample, reference);
  const PerSensor most = limit();
  const double growth = std::sqrt(std::max(1.0, reference.steps_to(sample.stamp)));
  return {size.gyro / (growth * most.gyro), size.accel / (growth * most.accel)};
}

ImuReference ImuGuard::reference_of_held(std::size_t i) const {
  return {held_.at(i), before_held(i)};
}

const ImuSample& ImuGuard::before_held(std::size_t i) const {
  return i > 0 ? held_.at(i - 1) : reference_->last;
}

const ImuSample* ImuGuard::newest() const {
  return held_count_ > 0 || reference_ ? &before_held(held_count_) : nullptr;
}

void ImuGuard::compare(const ImuSample& sample) {
  const ImuSample* const last = newest();
  if (last == nullptr || sample.stamp - last->stamp > kLongestGap) {
    const bool is_doubtful = has_jumped_ || has_refused_;
    // A first sample that is far off may be a part of a blow.
    const bool may_be_blow =
        reference_ && sample.stamp - last->stamp <= kLongestShock && !is_reachable(sample);
    drop_held(ImuFault::kSpike);
    has_jumped_ = is_doubtful && reference_;
    if (!has_jumped_ && !may_be_blow) reference_.reset();
  }
  // The scale learns from refused samples too: a vibration that begins must not be refused for
  // long.
  if (reference_ && !has_jumped_) {
    add_innovation(
        innovation(sample, held_count_ > 0 ? reference_of_held(held_count_ - 1) : *reference_));
  }
  const bool is_in_doubt = held_count_ > 0 || has_jumped_;
  if (reference_ && is_in_doubt) {
    judge(sample);
  } else if (!reference_ || excess(sample, *reference_).most() <= 1.0) {
    believe(sample);
  } else {
    hold(sample);
  }
}

void ImuGuard::add_innovation(const PerSensor& innovation) {
  gyro_.add(innovation.gyro);
  accel_.add(innovation.accel);
}

void ImuGuard::believe(const ImuSample& sample) {
  if (reference_) {
    blow_.end(sample, reference_->last, largest_change().gyro);
    turn_force(sample, reference_->last.stamp);
    correct_force(sample);
    reference_ = ImuReference{sample, reference_->last};
  } else {
    if (force_.isZero() || angle_between(sample.accel_mps2, force_) > kMostTurned) {
      force_ = sample.accel_mps2;
      since_ = sample.stamp;
    }
    reference_ = ImuReference{sample, std::nullopt};
  }
  has_refused_ = false;
  believed_.at(believed_count_++) = sample;
}

void ImuGuard::turn_force(const ImuSample& sample, Timestamp since) {
  force_ = so3_exp(-to_seconds(sample.stamp - since) * sample.gyro_radps) * force_;
}

void ImuGuard::correct_force(const ImuSample& sample) {
  force_ += kForceShare * (sample.accel_mps2 - force_);
}

/// Keeps the force by the sensor that has not jumped.
void ImuGuard::follow_force(const ImuSample& sample, const ImuSample& last) {
  const PerSensor change = distance(sample, last);
  const PerSensor most = largest_change();
  gyro_has_jumped_ = gyro_has_jumped_ || change.gyro > most.gyro;
  accel_has_jumped_ = accel_has_jumped_ || change.accel > most.accel;
  if (!gyro_has_jumped_) turn_force(sample, last.stamp);
  if (!accel_has_jumped_) correct_force(sample);
}

void ImuGuard::believe_held(std::size_t from) {
  count(ImuFault::kSpike, from);
  for (std::size_t i = 0; i < from; ++i) refuse_spike(held_.at(i));
  for (std::size_t i = from; i < held_count_; ++i) believe(held_.at(i));
  clear_held();
}

void ImuGuard::refuse_spike(const ImuSample& spike) {
  blow_.add(spike, reference_->last);
  if (spike_count_ == kMostSpikes) {
    std::shift_left(spikes_.begin(), spikes_.end(), 1);
    --spike_count_;
  }
  spikes_.at(spike_count_++) = spike;
}

void ImuGuard::drop_held(ImuFault fault) {
  count(has_jumped_ ? ImuFault::kJump : fault, held_count_);
  blow_.forget();
  clear_held();
}

void ImuGuard::clear_held() {
  held_count_ = 0;
  has_jumped_ = gyro_has_jumped_ = accel_has_jumped_ = false;
}

void ImuGuard::hold(const ImuSample& sample) {
  follow_force(sample, before_held(held_count_));
  if (held_count_ == kMostHeld) {
    blow_.add(held_.front(), reference_->last);
    std::shift_left(held_.begin(), held_.end(), 1);
    --held_count_;
    count(ImuFault::kJump);
  }
  held_.at(held_count_++) = sample;
}

/// Decides what the held samples are, if it can.
void ImuGuard::judge(const ImuSample& sample) {
  if (!has_jumped_) {
    const PerSensor back = excess(sample, *reference_);
    const PerSensor on = excess(sample, reference_of_held(held_count_ - 1));
    if (back.most() <= 1.0 && on.most() > back.most()) {
      const bool agrees_with_last = held_count_ > 1 && on.most() <= 1.0;
      believe_held(is_shock(back, on) ? 0 : agrees_with_last ? first_of_level() : held_count_);
      return believe(sample);
    }
    if (on.most() <= 1.0 && is_reachable(sample)) {
      believe_held(first_of_level());
      return believe(sample);
    }
  }
  hold(sample);
  if (has_jumped_) {
    if (held_count_ == kMostHeld && held_are_plausible()) restart_from_held();
  } else if (held_count_ == kVibrates && are_held_reachable()) {
    believe_held(0);
  } else if (held_count_ == kJumps) {
    has_jumped_ = true;
  }
}

/// True if the held sample shows a blow: the force returns at once, the rate that it caused stays.
bool ImuGuard::is_shock(const PerSensor& back, const PerSensor& on) const {
  constexpr double kNoticeable = 0.5;
  return held_count_ == 1 && back.gyro > kNoticeable && on.gyro <= kNoticeable;
}

/// The first held sample from which on the motion may have gone on to the last one. Its force may
/// differ if its rates agree: see is_shock.
std::size_t ImuGuard::first_of_level() const {
  std::size_t first = held_count_ - 1;
  while (first > 0 && (is_reachable(held_.at(first - 1)) ||
                       excess(held_.at(first), reference_of_held(first - 1)).gyro <= 1.0))
    --first;
  return first;
}

/// From the last believed sample, which may have been a part of a blow: then the force returns to
/// what it was over the last samples.
bool ImuGuard::is_reachable(const ImuSample& sample) const {
  PerSensor change = distance(sample, reference_->last);
  change.accel = std::min(change.accel, (sample.accel_mps2 - force_).norm());
  return is_within(change, largest_change());
}

bool ImuGuard::are_held_reachable() const {
  const std::span held = std::span(held_).first(held_count_);
  return std::ranges::all_of(held, [this](const ImuSample& one) { return is_reachable(one); });
}

bool ImuGuard::held_are_plausible() const {
  constexpr std::size_t kHalf = kMostHeld / 2;
  Eigen::Vector3d early = Eigen::Vector3d::Zero();
  Eigen::Vector3d late = Eigen::Vector3d::Zero();
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();  // from the early half to the late one
  InnovationScale gyro;
  InnovationScale accel;
  PerSensor largest_innovation;
  for (std::size_t i = 0; i < kMostHeld; ++i) {
    const ImuSample& sample = held_.at(i);
    (i < kHalf ? early : late) += sample.accel_mps2 / kHalf;
    if (i == 0) continue;
    const double dt = to_seconds(sample.stamp - held_.at(i - 1).stamp);
    if (i >= kHalf / 2 && i < kHalf + kHalf / 2) turn = turn * so3_exp(dt * sample.gyro_radps);
    const PerSensor size = innovation(
        sample, {held_.at(i - 1), i > 1 ? std::optional(held_.at(i - 2)) : std::nullopt});
    largest_innovation = largest(largest_innovation, size);
    gyro.add(size.gyro);
    accel.add(size.accel);
  }
  const PerSensor usual{gyro.median(), accel.median()};
  const PerSensor most = largest(kLargestChange, {kMedians * usual.gyro, kMedians * usual.accel});
  if (!is_within(usual, kMostVibration) || !is_within(largest_innovation, most)) return false;
  // Vibration shakes both sensors. Another unit scales the noise of one.
  const double gyro_growth = kMedians * usual.gyro / limit().gyro;
  const double accel_growth = kMedians * usual.accel / limit().accel;
  if (gyro_growth > kMostGrowth * std::max(1.0, accel_growth)) return false;

  const Eigen::Vector3d force = 0.5 * (early + late);
  if (force.norm() < kLeastForce || force.norm() > kMostForce) return false;
  if (angle_between(turn.conjugate() * early, late) > kMostContradiction) return false;
  const Timestamp last = reference_->last.stamp;
  return angle_between(late, force_) <= kMostTurned ||
         held_.front().stamp - last > std::min(kOutdated, last - since_);
}

void ImuGuard::restart_from_held() {
  for (std::size_t i = 2; i < held_count_; ++i)
    add_innovation(innovation(held_.at(i), reference_of_held(i - 1)));
  if (gyro_has_jumped_) blow_.forget();
  blow_.end(held_.front(), reference_->last, largest_change().gyro);
  reference_.reset();
  force_.setZero();
  believe_held(0);
}

}  // namespace crepes
