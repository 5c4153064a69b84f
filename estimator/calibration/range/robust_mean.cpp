#include "estimator/calibration/range/robust_mean.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/core/quantile.hpp"

namespace crepes {
namespace {

constexpr double kSigmaOfMad = 1.4826;  // of a normal distribution
constexpr double kCutoff = 4.685;       // sigmas: 95 % efficient
constexpr double kLeastScale = 1e-6;
constexpr int kSteps = 20;

}  // namespace

double RobustMean::sigma() const {
  return used == 0 ? std::numeric_limits<double>::infinity()
                   : scatter / std::sqrt(static_cast<double>(used));
}

RobustMean robust_mean(std::vector<double> values) {
  if (values.empty()) return {};
  RobustMean mean{.value = upper_median(values)};
  std::vector<double> deviations;
  for (const double value : values) deviations.push_back(std::abs(value - mean.value));
  const double scale = std::max(kLeastScale, kSigmaOfMad * upper_median(deviations));
  for (int step = 0; step < kSteps; ++step) {
    double sum = 0.0;
    double weights = 0.0;
    for (const double value : values) {
      const double r = (value - mean.value) / (kCutoff * scale);
      const double weight = std::abs(r) < 1.0 ? std::pow(1.0 - r * r, 2) : 0.0;
      sum += weight * value;
      weights += weight;
    }
    if (weights > 0.0) mean.value = sum / weights;
  }
  mean.scatter = scale;
  mean.used = static_cast<std::size_t>(std::ranges::count_if(
      values, [&](double value) { return std::abs(value - mean.value) < kCutoff * scale; }));
  return mean;
}

}  // namespace crepes
