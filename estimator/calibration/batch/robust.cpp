#include "estimator/calibration/batch/robust.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/core/quantile.hpp"

namespace crepes {
namespace {

constexpr double kLeastSpotSigma_px = 0.02;
constexpr double kMedianOfSquare2 = 1.3863;  // of the squared length of a 2-D normal
constexpr double kRobustSigmas = 3.0;
constexpr double kOutlierWeight = 0.25;

}  // namespace

double robust_sigma_px(std::vector<double> squares) {
  if (squares.empty()) return kLeastSpotSigma_px;
  return std::max(kLeastSpotSigma_px, std::sqrt(upper_median(squares) / kMedianOfSquare2));
}

double robust_weight(double square, double sigma, double dimension) {
  const double c2 = dimension * std::pow(kRobustSigmas * sigma, 2) * 2.0;
  return 1.0 / std::pow(1.0 + square / c2, 2);
}

double outlier_share(std::span<const double> weights) {
  const auto low = std::ranges::count_if(weights, [](double w) { return w < kOutlierWeight; });
  return static_cast<double>(low) / std::max(1.0, static_cast<double>(weights.size()));
}

}  // namespace crepes
