#include "estimator/calibration/imu/stillness.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "estimator/core/quantile.hpp"

namespace crepes {
namespace {

constexpr std::size_t kAround = 30;      // seconds before and after
constexpr double kSigmas = 10.0;         // seldom in a night, also with a bias that wanders
constexpr double kSigmaOfMedian = 1.48;  // of normal deviations' absolute values

std::vector<double> means_of_seconds(std::span<const double> readings, double period_s) {
  const auto each = static_cast<std::size_t>(std::max(1.0, std::round(1.0 / period_s)));
  std::vector<double> means;
  for (std::size_t from = 0; from + each <= readings.size(); from += each) {
    double sum = 0.0;
    for (const double reading : readings.subspan(from, each)) sum += reading;
    means.push_back(sum / static_cast<double>(each));
  }
  return means;
}

}  // namespace

std::optional<double> first_motion_s(std::span<const double> readings, double period_s) {
  const std::vector<double> means = means_of_seconds(readings, period_s);
  if (means.size() < 4 * kAround) return std::nullopt;
  std::vector<double> sums(means.size() + 1, 0.0);
  for (std::size_t i = 0; i < means.size(); ++i) sums[i + 1] = sums[i] + means[i] - means.front();
  std::vector<double> off;
  for (std::size_t i = kAround; i + kAround < means.size(); ++i) {
    const double around = (sums[i + kAround + 1] - sums[i - kAround]) / (2.0 * kAround + 1.0);
    off.push_back(std::abs(means[i] - means.front() - around));
  }
  std::vector<double> sorted = off;
  const double sigma = kSigmaOfMedian * upper_median(sorted);
  if (sigma == 0.0) return std::nullopt;  // a sensor too coarse to show its noise
  const auto moved =
      std::ranges::find_if(off, [sigma](double each) { return each > kSigmas * sigma; });
  if (moved == off.end()) return std::nullopt;
  return static_cast<double>(moved - off.begin()) + static_cast<double>(kAround);
}

}  // namespace crepes
