#include "drivers/device_clock.hpp"

#include <algorithm>
#include <chrono>

#include "estimator/core/crystal_skew.hpp"

namespace crepes {
namespace {

constexpr double kTolerance = 10e-3;  // s; a clock that gains more at once has jumped
constexpr double kMaxDelay = 1.0;     // s; no stamp is delayed longer
constexpr double kWindow = 0.5;       // s
constexpr double kBehind =
    20e-3;  // s; if even the fastest of a window is later, the clock has stopped
constexpr int kEnoughWindows = 2;
constexpr Duration kLongestStep = std::chrono::hours{1};

/// The step from one reading to the next; negative if the counter decreased.
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
  const std::optional<double> delay = segment_ ? delay_of(stamp, arrival) : std::nullopt;
  if (!delay) {
    if (is_trusted()) ++restarts_;
    begin(stamp, arrival);
  }
  return delay && is_trusted() ? arrival - from_seconds(*delay) : arrival;
}

bool DeviceClock::is_trusted() const {
  return segment_ && segment_->windows_kept >= kEnoughWindows;
}

void DeviceClock::begin(DeviceTime stamp, Timestamp arrival) {
  segment_ = Segment{.origin = arrival, .last = stamp};
  segment_->bounds.offer({}, 0.0);
}

std::optional<double> DeviceClock::delay_of(DeviceTime stamp, Timestamp arrival) {
  Segment& segment = *segment_;
  if (stamp.wrap_ns != segment.last.wrap_ns) return std::nullopt;
  const Duration step = step_between(segment.last, stamp);
  if (step < Duration::zero() || step > kLongestStep) return std::nullopt;
  segment.last = stamp;
  segment.elapsed += step;

  const double now = to_seconds(arrival - segment.origin);
  const OffsetBound bound{now, to_seconds(segment.elapsed) - now};
  if (bound.offset > segment.at(now) + kTolerance) return std::nullopt;
  if (segment.bounds.offer(bound, segment.skew)) refit(now);
  const double delay = std::max(segment.at(now) - bound.offset, 0.0);
  if (delay > kMaxDelay || !keeps_pace(now, delay)) return std::nullopt;
  return delay;
}

/// With exponential delays of mean mu, the most likely line above the bounds l_i is
///   max over k of  -max_i (l_i - k t_i) n / mu - k^2 / (2 sigma_k^2)
/// with times from their mean.
void DeviceClock::refit(double now) {
  Segment& segment = *segment_;
  const std::vector<OffsetBound> bounds = segment.bounds.bounds(now);
  double sum = 0.0;
  for (const OffsetBound& bound : bounds) sum += bound.t;
  const double center = sum / static_cast<double>(bounds.size());
  const double guess = tightest(bounds, segment.skew, center, +1);
  const double scale = std::max(envelope_sigma(bounds, segment.skew, center, guess, 0.0), 1e-7);
  segment.skew = maximizer(-kMaxSkew, kMaxSkew, [&](double k) {
    return -tightest(bounds, k, center, +1) / scale - 0.5 * (k / kSkewPrior) * (k / kSkewPrior);
  });
  segment.center = center;
  segment.offset = tightest(bounds, segment.skew, center, +1);
}

bool DeviceClock::keeps_pace(double now, double delay) {
  Segment& segment = *segment_;
  if (!segment.least_delay) segment.window_end = now + kWindow;
  const double least = std::min(segment.least_delay.value_or(delay), delay);
  segment.least_delay = least;
  if (now < segment.window_end) return true;
  segment.least_delay.reset();
  ++segment.windows_kept;
  return least <= kBehind;
}

}  // namespace crepes
