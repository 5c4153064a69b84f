#include "estimator/calibration/imu/rests.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/core/quantile.hpp"

namespace crepes {
namespace {

constexpr double kHalfWindow_s = 0.25;
constexpr double kMinRest_s = 0.5;       // beside the half window at either end
constexpr double kQuietShare = 0.1;      // of the recording: sets the noise at rest
constexpr double kMaxVariance = 2.5;     // of a window at rest, in units of the noise's
constexpr double kHeldSigma = 0.2;       // [rad/s] and ...
constexpr double kHeldAccelSigma = 1.0;  // [m/s^2] of what a hand holds
constexpr double kHeldRate = 0.15;       // [rad/s]
constexpr double kHeld_s = 1.0;

/// Sums of the samples' six readings and their squares, so that each window costs the same.
class WindowMoments {
 public:
  explicit WindowMoments(std::span<const ImuSample> samples) : sums_(samples.size() + 1) {
    for (std::size_t i = 0; i < samples.size(); ++i) {
      // Sums of differences from the first sample keep their digits.
      const Eigen::Vector3d w = samples[i].gyro_radps - samples[0].gyro_radps;
      const Eigen::Vector3d a = samples[i].accel_mps2 - samples[0].accel_mps2;
      sums_[i + 1] = {sums_[i].w + w, sums_[i].a + a, sums_[i].w2 + w.squaredNorm(),
                      sums_[i].a2 + a.squaredNorm()};
    }
  }

  struct Variances {
    double gyro = 0.0;  ///< per axis
    double accel = 0.0;
    double rate2 = 0.0;  ///< squared mean rate, from the first sample's reading
  };
  [[nodiscard]] Variances of(std::size_t first, std::size_t last) const {
    constexpr double kAxes = 3.0;
    const auto n = static_cast<double>(last - first);
    const Eigen::Vector3d w = (sums_[last].w - sums_[first].w) / n;
    const Eigen::Vector3d a = (sums_[last].a - sums_[first].a) / n;
    const double bessel = n / (kAxes * std::max(1.0, n - 1.0));
    return {bessel * std::max(0.0, (sums_[last].w2 - sums_[first].w2) / n - w.squaredNorm()),
            bessel * std::max(0.0, (sums_[last].a2 - sums_[first].a2) / n - a.squaredNorm()),
            w.squaredNorm()};
  }

 private:
  struct Sums {
    Eigen::Vector3d w = Eigen::Vector3d::Zero();
    Eigen::Vector3d a = Eigen::Vector3d::Zero();
    double w2 = 0.0;
    double a2 = 0.0;
  };
  std::vector<Sums> sums_;
};

struct Run {
  std::size_t first = 0;
  std::size_t last = 0;
};

std::vector<Run> runs_of(const std::vector<bool>& flags) {
  std::vector<Run> runs;
  for (std::size_t i = 0; i < flags.size(); ++i) {
    if (!flags[i]) continue;
    if (i == 0 || !flags[i - 1]) runs.push_back({i, i});
    runs.back().last = i + 1;
  }
  return runs;
}

Rest rest_of(std::span<const ImuSample> samples, const Run& run) {
  const auto seconds = [&](std::size_t i) {
    return to_seconds(samples[i].stamp - samples[0].stamp);
  };
  Rest rest{.first = run.first,
            .last = run.last,
            .begin_s = seconds(run.first),
            .end_s = seconds(run.last - 1)};
  for (std::size_t i = run.first; i < run.last; ++i) {
    rest.gyro_radps += samples[i].gyro_radps;
    rest.accel_mps2 += samples[i].accel_mps2;
  }
  const auto n = static_cast<double>(run.last - run.first);
  rest.gyro_radps /= n;
  rest.accel_mps2 /= n;
  return rest;
}

std::vector<WindowMoments::Variances> windows_of(std::span<const ImuSample> samples,
                                                 double period_s) {
  const WindowMoments moments(samples);
  const auto half = static_cast<std::size_t>(std::ceil(kHalfWindow_s / period_s));
  std::vector<WindowMoments::Variances> windows;
  windows.reserve(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i)
    windows.push_back(moments.of(i < half ? 0 : i - half, std::min(samples.size(), i + half + 1)));
  return windows;
}

template <class Of>
double quiet_variance(const std::vector<WindowMoments::Variances>& windows, const Of& of) {
  std::vector<double> values;
  values.reserve(windows.size());
  for (const auto& window : windows) values.push_back(of(window));
  return quantile(values, kQuietShare);
}

/// The noise of the rests' samples about their rest's mean. The quietest part shows a little less.
void measure_noise(std::span<const ImuSample> samples, RestSearch& found) {
  constexpr double kAxes = 3.0;
  double gyro = 0.0;
  double accel = 0.0;
  double count = 0.0;
  for (const Rest& rest : found.rests) {
    for (std::size_t i = rest.first; i < rest.last; ++i) {
      gyro += (samples[i].gyro_radps - rest.gyro_radps).squaredNorm();
      accel += (samples[i].accel_mps2 - rest.accel_mps2).squaredNorm();
    }
    count += static_cast<double>(rest.last - rest.first - 1);
  }
  if (found.rests.empty()) return;
  found.gyro_sigma_radps = std::sqrt(gyro / (kAxes * count));
  found.accel_sigma_mps2 = std::sqrt(accel / (kAxes * count));
}

/// Counts the pauses of a hand without a rest in them.
void count_shaky(const std::vector<WindowMoments::Variances>& windows,
                 const std::vector<bool>& is_rest, double period_s, RestSearch& found) {
  std::vector<bool> is_held(windows.size());
  for (std::size_t i = 0; i < windows.size(); ++i)
    is_held[i] = windows[i].gyro < kHeldSigma * kHeldSigma &&
                 windows[i].accel < kHeldAccelSigma * kHeldAccelSigma &&
                 windows[i].rate2 < kHeldRate * kHeldRate;
  std::vector<double> shakes;
  for (const Run& run : runs_of(is_held)) {
    if (static_cast<double>(run.last - run.first) * period_s < kHeld_s) continue;
    const auto begin = is_rest.begin();
    if (std::count(begin + static_cast<std::ptrdiff_t>(run.first),
                   begin + static_cast<std::ptrdiff_t>(run.last), true) > 0)
      continue;
    shakes.push_back(std::sqrt(windows[(run.first + run.last) / 2].gyro));
  }
  found.shaky = static_cast<int>(shakes.size());
  if (!shakes.empty()) found.shake_radps = quantile(shakes, 0.5);
}

}  // namespace

RestSearch find_rests(std::span<const ImuSample> samples) {
  RestSearch found;
  if (samples.size() < 2) return found;
  const double period_s = to_seconds(samples.back().stamp - samples.front().stamp) /
                          static_cast<double>(samples.size() - 1);
  if (!(period_s > 0.0)) return found;
  const auto windows = windows_of(samples, period_s);
  const double gyro = quiet_variance(windows, [](const auto& w) { return w.gyro; });
  const double accel = quiet_variance(windows, [](const auto& w) { return w.accel; });
  found.gyro_sigma_radps = std::sqrt(gyro);
  found.accel_sigma_mps2 = std::sqrt(accel);

  std::vector<bool> is_rest(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i)
    is_rest[i] = windows[i].gyro <= kMaxVariance * gyro && windows[i].accel <= kMaxVariance * accel;
  std::vector<bool> is_in_rest(samples.size(), false);
  for (const Run& run : runs_of(is_rest)) {
    if (static_cast<double>(run.last - run.first) * period_s < kMinRest_s) continue;
    found.rests.push_back(rest_of(samples, run));
    for (std::size_t i = run.first; i < run.last; ++i) is_in_rest[i] = true;
  }
  measure_noise(samples, found);
  count_shaky(windows, is_in_rest, period_s, found);
  return found;
}

}  // namespace crepes
