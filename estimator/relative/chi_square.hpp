/// Gates for normalized innovations.
#pragma once

#include <cmath>

namespace crepes {

/// Quantile of the standard normal distribution, 0.5 <= p < 1 (Abramowitz and Stegun 26.2.23,
/// absolute error below 5e-4).
[[nodiscard]] inline double normal_quantile(double p) {
  const double t = std::sqrt(-2.0 * std::log(1.0 - p));
  return t - (2.515517 + t * (0.802853 + t * 0.010328)) /
                 (1.0 + t * (1.432788 + t * (0.189269 + t * 0.001308)));
}

/// Quantile of the chi-square distribution: from the normal and the exponential distribution for
/// one and two degrees of freedom, above by Wilson and Hilferty 1931, within 2 % for p >= 0.9.
[[nodiscard]] inline double chi_square_quantile(double p, int degrees_of_freedom) {
  if (degrees_of_freedom == 1) return std::pow(normal_quantile(0.5 + 0.5 * p), 2);
  if (degrees_of_freedom == 2) return -2.0 * std::log(1.0 - p);
  const double k = 2.0 / (9.0 * degrees_of_freedom);
  const double root = 1.0 - k + normal_quantile(p) * std::sqrt(k);
  return degrees_of_freedom * root * root * root;
}

}  // namespace crepes
