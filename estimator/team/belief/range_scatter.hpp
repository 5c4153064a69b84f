/// By how much ranges err more than the configuration says.
#pragma once

#include <algorithm>
#include <cmath>

namespace crepes {

/// Follows the share of innovations beyond one sigma, so that an outlier counts like any other of
/// these (stochastic approximation of a quantile: Robbins and Monro 1951). Ranges are believed as
/// configured until they surely err more.
class RangeScatter {
 public:
  /// Of the errors' variance: what it is at least, by two sigma of its estimate.
  [[nodiscard]] double factor() const {
    constexpr double kTwoSigma = 4.0;  // of the logarithm, by a single innovation
    return std::exp(std::max(0.0, log_factor_ - kTwoSigma / std::sqrt(kFirst + count_)));
  }

  /// An innovation's NIS, one dof, with the variance of the range as this factor makes it.
  void add(double nis) {
    constexpr double kShareBeyond = 0.317;  // one sigma of a Gaussian
    constexpr double kStep = 4.0;           // best for a Gaussian: one over its density there
    constexpr double kMemory = 300.0;       // innovations
    count_ = std::min(count_ + 1.0, kMemory);
    const double step = kStep / (kFirst + count_) * ((nis > 1.0 ? 1.0 : 0.0) - kShareBeyond);
    log_factor_ = std::clamp(log_factor_ + step, -kBelow, std::log(kMost));
  }

 private:
  static constexpr double kFirst = 10.0;  // innovations that the configuration is worth
  static constexpr double kMost = 9.0;    // three times the sigma
  static constexpr double kBelow = 0.5;

  double log_factor_ = 0.0;
  double count_ = 0.0;
};

}  // namespace crepes
