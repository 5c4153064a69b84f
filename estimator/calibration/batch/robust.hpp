/// What residuals of spots and ranges say of their noise, and how little outliers weigh.
#pragma once

#include <span>
#include <vector>

namespace crepes {

/// One sigma of a spot's coordinate [px], from the median of the squared lengths of residuals
/// [px^2]. At least 0.02 px, also without residuals.
[[nodiscard]] double robust_sigma_px(std::vector<double> squares);

/// The weight of a residual of this square, whose coordinates have this sigma (Geman-McClure):
///   w = 1 / (1 + r^2 / c^2)^2,  c^2 = 2 dimension (3 sigma)^2 .
[[nodiscard]] double robust_weight(double square, double sigma, double dimension);

/// The share of the weights that make outliers.
[[nodiscard]] double outlier_share(std::span<const double> weights);

}  // namespace crepes
