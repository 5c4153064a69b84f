/// How a range's error follows the direction in which an antenna is turned.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

namespace crepes {

/// Error over the heading of the module that turned: a mean and two harmonics.
struct TurnPattern {
  static constexpr std::size_t kDirections = 8;

  double mean_m = 0.0;
  double mean_sigma_m = 0.0;
  double rms_m = 0.0;  ///< of what follows the heading
  std::array<double, kDirections>
      deviation_m{};       ///< from the mean, every 45 deg from the first heading
  double scatter_m = 0.0;  ///< one sigma of a single range about it
  std::size_t used = 0;    ///< ranges that are no outliers
};

/// Harmonics by least squares, in which outliers weigh nothing (Tukey's biweight). `errors_m` are
/// measured less taped, `headings_rad` the module's heading at each, from 0 on. Empty unless the
/// headings cover a full turn, with gaps of 90 degrees at most.
[[nodiscard]] std::optional<TurnPattern> fit_turn_pattern(std::span<const double> errors_m,
                                                          std::span<const double> headings_rad);

}  // namespace crepes
