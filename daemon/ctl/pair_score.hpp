/// How good the poses of one ordered pair are: absolute trajectory error without alignment (Zhang
/// and Scaramuzza 2018, "A tutorial on quantitative trajectory evaluation", IV), availability and
/// consistency.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "estimator/core/outputs.hpp"

namespace crepes {

/// Of a set of errors; NaN where there are none.
struct ErrorStatistics {
  double rmse;
  double mean;
  double median;
  double max;
};
[[nodiscard]] ErrorStatistics statistics_of(std::vector<double> errors);

/// The share of `values` that is at most `limit`; NaN of nothing.
[[nodiscard]] double share_within(const std::vector<double>& values, double limit);

/// The middle value, or the mean of the two in the middle; NaN of nothing.
[[nodiscard]] double median_of(std::vector<double> values);

/// What is scored, on the observer's clock: both ends belong to it.
struct ScoreWindow {
  Timestamp begin{};
  Timestamp end{};
};

inline constexpr double kNees95 = 12.59;

struct PairScore {
  std::size_t rows = 0;                     ///< inside the window
  double availability = 0.0;                ///< share of the window's 50 Hz instants with a row
  std::vector<double> position_errors_m;    ///< ||p_est - p_true||, one a row
  std::vector<double> rotation_errors_rad;  ///< angle of R_est^T R_true, one a row
  std::array<std::size_t, 3> modes{};       ///< rows by PoseMode
  /// Normalized estimation error squared, one a row with a proper covariance. Six degrees of
  /// freedom: of a consistent estimator the median is 5.35, and 95 % lie below `kNees95`.
  std::vector<double> nees;
  /// Times that it was wrong for more than a second without knowing: an error above ten sigma, or
  /// above 1 m or 20 deg, beyond which nothing may be published.
  std::size_t divergences = 0;
  std::size_t bad_covariances = 0;    ///< rows whose covariance is not positive definite
  Duration max_age{};                 ///< greatest `published - stamp`
  std::optional<Duration> first_row;  ///< the very first row's stamp since `start`
};

/// Truth of the pair at an instant of the observer's clock.
using RelativeTruth = std::function<std::optional<Pose>(Timestamp)>;

/// Scores `poses` (stamps increase) inside `window`; `start` is when the recording began. Rows
/// without truth count for availability alone.
[[nodiscard]] PairScore score_pair(std::span<const NeighborPose> poses, const RelativeTruth& truth,
                                   Timestamp start, const ScoreWindow& window);

}  // namespace crepes
