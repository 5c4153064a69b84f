/// Order statistics of unsorted values.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

namespace crepes {

/// The value at place `index` if all were sorted. Partly sorts `values`.
[[nodiscard]] inline double order_statistic(std::span<double> values, std::size_t index) {
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(index);
  std::ranges::nth_element(values, place);
  return *place;
}

/// The value that a share of the others does not exceed; 0.5 is the lower median. Partly sorts
/// `values`, which are not empty.
[[nodiscard]] inline double quantile(std::span<double> values, double share) {
  return order_statistic(values,
                         static_cast<std::size_t>(share * static_cast<double>(values.size() - 1)));
}

/// The median; of an even number, the upper of the two in the middle. Partly sorts `values`, which
/// are not empty.
[[nodiscard]] inline double upper_median(std::span<double> values) {
  return order_statistic(values, values.size() / 2);
}

}  // namespace crepes
