/// The noise of an inertial sensor at rest, by Allan deviation.
#pragma once

#include <optional>
#include <span>
#include <vector>

namespace crepes {

/// The deviation of means over one averaging time.
struct AllanPoint {
  double tau_s = 0.0;
  double sigma = 0.0;  ///< Allan deviation, in the unit of the readings
  double count = 0.0;  ///< independent clusters
};

/// Overlapping Allan deviation of equally spaced readings, over clusters of 1, 2, 3, 4, 6, 8, ...
/// samples up to a fifth of the recording (IEEE Std 952-1997, annex C).
[[nodiscard]] std::vector<AllanPoint> allan_deviation(std::span<const double> readings,
                                                      double period_s);

/// White noise N and random walk K of  sigma^2 = N^2 / tau + B^2 + K^2 tau / 3 .
struct NoiseDensities {
  double white = 0.0;           ///< [unit / sqrt(Hz)]
  double white_sigma = 0.0;     ///< one sigma
  double bias_stability = 0.0;  ///< the flat part B [unit]
  double random_walk = 0.0;     ///< [unit / s / sqrt(Hz)]
  double random_walk_sigma = 0.0;
};

/// Least squares over all points, none of the three negative. Empty with fewer than four points.
[[nodiscard]] std::optional<NoiseDensities> fit_noise(std::span<const AllanPoint> points);

}  // namespace crepes
