#include "estimator/calibration/imu/wandering_bias.hpp"

#include <cmath>

namespace crepes {
namespace {

double middle_of(const Rest& rest) { return 0.5 * (rest.begin_s + rest.end_s); }

}  // namespace

WanderingBias::WanderingBias(const std::vector<Rest>& rests, double density, double random_walk)
    : at_rest_(rests.size()) {
  const double q = random_walk * random_walk;
  const std::size_t n = rests.size();
  std::vector<double> filtered(n);
  std::vector<double> predicted(n);
  for (std::size_t k = 0; k < n; ++k) {
    const double noise = density * density / rests[k].duration_s();
    if (k == 0) {
      at_rest_[0] = rests[0].gyro_radps;
      filtered[0] = noise;
      continue;
    }
    predicted[k] = filtered[k - 1] + q * (middle_of(rests[k]) - middle_of(rests[k - 1]));
    const double gain = predicted[k] / (predicted[k] + noise);
    at_rest_[k] = at_rest_[k - 1] + gain * (rests[k].gyro_radps - at_rest_[k - 1]);
    filtered[k] = (1.0 - gain) * predicted[k];
  }
  double variance = filtered[n - 1];
  double sum_of_variances = rests[n - 1].duration_s() * variance;
  for (std::size_t k = n - 1; k-- > 0;) {
    const double gain = filtered[k] / predicted[k + 1];
    // Of the filter's estimates only the later one is smoothed already; the prediction is the
    // earlier estimate itself.
    at_rest_[k] += gain * (at_rest_[k + 1] - at_rest_[k]);
    variance = filtered[k] + gain * gain * (variance - predicted[k + 1]);
    sum_of_variances += (rests[k + 1].begin_s - rests[k].begin_s) * variance;
  }

  double total_s = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    const double begin = k == 0 ? rests[0].begin_s : 0.5 * (rests[k - 1].end_s + rests[k].begin_s);
    const double end = k + 1 == n ? rests[k].end_s : 0.5 * (rests[k].end_s + rests[k + 1].begin_s);
    mean_ += (end - begin) * at_rest_[k];
    total_s += end - begin;
  }
  mean_ /= total_s;
  // Errors of neighbors are correlated over sqrt(noise / q) seconds: not independent, not equal.
  const double correlation_s =
      q > 0.0 ? std::min(total_s, 2.0 * std::sqrt(density * density / q)) : total_s;
  mean_sigma_ = std::sqrt(sum_of_variances / total_s * correlation_s / total_s);
}

Eigen::Vector3d WanderingBias::between(std::size_t k) const {
  return 0.5 * (at_rest_[k] + at_rest_[k + 1]);
}

}  // namespace crepes
