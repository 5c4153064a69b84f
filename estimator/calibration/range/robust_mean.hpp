/// A mean that outliers do not move.
#pragma once

#include <cstddef>
#include <vector>

namespace crepes {

struct RobustMean {
  double value = 0.0;
  double scatter = 0.0;  ///< one sigma of a single value, without outliers
  std::size_t used = 0;  ///< values of nonzero weight

  /// One sigma of the mean.
  [[nodiscard]] double sigma() const;
};

/// Tukey's biweight location about the median, with the scale of the median absolute deviation
/// (Huber, Ronchetti 2009, section 4.8). Zero for no values.
[[nodiscard]] RobustMean robust_mean(std::vector<double> values);

}  // namespace crepes
