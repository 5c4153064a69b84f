#include "estimator/calibration/range/turn_pattern.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "estimator/core/constants.hpp"
#include "estimator/core/quantile.hpp"

namespace crepes {
namespace {

using Harmonics = Eigen::Matrix<double, 5, 1>;

constexpr double kLeastTurn_rad = radians(330.0);
constexpr double kWidestGap_rad = radians(90.0);  // harmonics across a wider one are a guess
constexpr int kRounds = 10;
constexpr double kTukey = 4.7;  // sigmas
constexpr double kSigmaOfMedianAbs = 1.4826;

Harmonics harmonics_at(double heading_rad) {
  return {1.0, std::cos(heading_rad), std::sin(heading_rad), std::cos(2.0 * heading_rad),
          std::sin(2.0 * heading_rad)};
}

/// The widest arc of the circle without a heading.
double widest_gap(std::span<const double> headings_rad) {
  constexpr double kCircle = 2.0 * std::numbers::pi;
  std::vector<double> sorted(headings_rad.begin(), headings_rad.end());
  for (double& heading : sorted) heading -= kCircle * std::floor(heading / kCircle);
  std::ranges::sort(sorted);
  double widest = sorted.front() + kCircle - sorted.back();
  for (std::size_t i = 1; i < sorted.size(); ++i)
    widest = std::max(widest, sorted[i] - sorted[i - 1]);
  return widest;
}

double median_abs(std::vector<double> values) {
  for (double& value : values) value = std::abs(value);
  return upper_median(values);
}

double tukey_weight(double residual, double sigma) {
  const double x = residual / (kTukey * sigma);
  return std::abs(x) < 1.0 ? std::pow(1.0 - x * x, 2) : 0.0;
}

}  // namespace

std::optional<TurnPattern> fit_turn_pattern(std::span<const double> errors_m,
                                            std::span<const double> headings_rad) {
  if (errors_m.empty()) return std::nullopt;
  const auto [least, most] = std::ranges::minmax(headings_rad);
  if (most - least < kLeastTurn_rad || widest_gap(headings_rad) > kWidestGap_rad)
    return std::nullopt;
  std::vector<double> weights(errors_m.size(), 1.0);
  std::vector<double> residuals(errors_m.size(), 0.0);
  Harmonics c = Harmonics::Zero();
  Eigen::Matrix<double, 5, 5> H;
  double sigma = 0.0;
  for (int round = 0; round < kRounds; ++round) {
    H.setZero();
    Harmonics g = Harmonics::Zero();
    for (std::size_t i = 0; i < errors_m.size(); ++i) {
      const Harmonics h = harmonics_at(headings_rad[i]);
      H += weights[i] * h * h.transpose();
      g += weights[i] * h * errors_m[i];
    }
    c = H.ldlt().solve(g);
    for (std::size_t i = 0; i < errors_m.size(); ++i)
      residuals[i] = errors_m[i] - c.dot(harmonics_at(headings_rad[i]));
    sigma = std::max(1e-4, kSigmaOfMedianAbs * median_abs(residuals));
    for (std::size_t i = 0; i < errors_m.size(); ++i)
      weights[i] = tukey_weight(residuals[i], sigma);
  }
  TurnPattern found;
  found.mean_m = c[0];
  found.scatter_m = sigma;
  found.mean_sigma_m = sigma * std::sqrt(H.inverse()(0, 0));
  found.rms_m = std::sqrt(0.5 * c.tail<4>().squaredNorm());
  found.used = static_cast<std::size_t>(
      std::ranges::count_if(weights, [](double weight) { return weight > 0.0; }));
  for (std::size_t k = 0; k < TurnPattern::kDirections; ++k) {
    const double heading = 2.0 * std::numbers::pi * static_cast<double>(k) /
                           static_cast<double>(TurnPattern::kDirections);
    found.deviation_m.at(k) = c.tail<4>().dot(harmonics_at(heading).tail<4>());
  }
  return found;
}

}  // namespace crepes
