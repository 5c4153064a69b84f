#include "drivers/device_clock.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace crepes {
namespace {

constexpr double kSkewPrior = 50e-6;  // one sigma of a crystal against another
constexpr double kMaxSkew = 200e-6;   // no crystal is worse
constexpr double kTolerance = 10e-3;  // s; a clock that gains more at once has jumped
constexpr double kMaxDelay = 1.0;     // s; nothing waits longer
constexpr double kLook = 0.5;         // s
constexpr double kBehind = 20e-3;     // s; when all of a look is later, the clock has stopped
constexpr int kEnoughLooks = 2;
constexpr Duration kLongestStep = std::chrono::hours{1};

/// From one count to the next; negative where the counter went back.
Duration step_between(DeviceTime from, DeviceTime to) {
  if (to.wrap_ns == 0) return Duration{static_cast<std::int64_t>(to.ns - from.ns)};
  const std::uint64_t ahead = (to.ns + (to.wrap_ns - from.ns)) % to.wrap_ns;
  return Duration{static_cast<std::int64_t>(ahead > to.wrap_ns / 2 ? ahead - to.wrap_ns : ahead)};
}

}  // namespace

Timestamp DeviceClock::to_local(DeviceTime stamp, Timestamp arrival) {
  last_local_ = std::max(last_local_, std::min(map(stamp, arrival), arrival));
  return last_local_;
}

Timestamp DeviceClock::map(DeviceTime stamp, Timestamp arrival) {
  const std::optional<double> delay = course_ ? delay_of(stamp, arrival) : std::nullopt;
  if (!delay) {
    if (is_relied_on()) ++restarts_;
    begin(stamp, arrival);
  }
  return delay && is_relied_on() ? arrival - from_seconds(*delay) : arrival;
}

bool DeviceClock::is_relied_on() const { return course_ && course_->good_looks >= kEnoughLooks; }

void DeviceClock::begin(DeviceTime stamp, Timestamp arrival) {
  course_ = Course{.origin = arrival, .last = stamp};
  course_->bounds.offer({}, 0.0);
}

std::optional<double> DeviceClock::delay_of(DeviceTime stamp, Timestamp arrival) {
  Course& course = *course_;
  if (stamp.wrap_ns != course.last.wrap_ns) return std::nullopt;
  const Duration step = step_between(course.last, stamp);
  if (step < Duration::zero() || step > kLongestStep) return std::nullopt;
  course.last = stamp;
  course.elapsed += step;

  const double now = to_seconds(arrival - course.origin);
  const OffsetBound bound{now, to_seconds(course.elapsed) - now};
  if (bound.offset > course.at(now) + kTolerance) return std::nullopt;
  if (course.bounds.offer(bound, course.skew)) refit(now);
  const double delay = std::max(course.at(now) - bound.offset, 0.0);
  if (delay > kMaxDelay || !look(now, delay)) return std::nullopt;
  return delay;
}

/// Delays taken as exponential with mean mu, the most likely line above the bounds l_i is
///   max over k of  -max_i (l_i - k t_i) n / mu - k^2 / (2 sigma_k^2)
/// with times from their mean.
void DeviceClock::refit(double now) {
  Course& course = *course_;
  const std::vector<OffsetBound> bounds = course.bounds.bounds(now);
  double sum = 0.0;
  for (const OffsetBound& bound : bounds) sum += bound.t;
  const double center = sum / static_cast<double>(bounds.size());
  const double guess = tightest(bounds, course.skew, center, +1);
  const double scale = std::max(envelope_sigma(bounds, course.skew, center, guess, 0.0), 1e-7);
  course.skew = maximizer(-kMaxSkew, kMaxSkew, [&](double k) {
    return -tightest(bounds, k, center, +1) / scale - 0.5 * (k / kSkewPrior) * (k / kSkewPrior);
  });
  course.center = center;
  course.offset = tightest(bounds, course.skew, center, +1);
}

bool DeviceClock::look(double now, double delay) {
  Course& course = *course_;
  if (!course.least_delay) course.look_end = now + kLook;
  const double least = std::min(course.least_delay.value_or(delay), delay);
  course.least_delay = least;
  if (now < course.look_end) return true;
  course.least_delay.reset();
  ++course.good_looks;
  return least <= kBehind;
}

}  // namespace crepes
