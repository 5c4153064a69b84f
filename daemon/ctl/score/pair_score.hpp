/// Scores the poses of one ordered pair: absolute trajectory error without alignment (Zhang and
/// Scaramuzza 2018, "A tutorial on quantitative trajectory evaluation", IV), availability and
/// consistency.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "daemon/ctl/score/gross_errors.hpp"
#include "estimator/core/outputs.hpp"

namespace crepes {

/// Statistics of a set of errors; NaN if the set is empty.
struct ErrorStatistics {
  double rmse;
  double mean;
  double median;
  double max;
};
[[nodiscard]] ErrorStatistics statistics_of(std::vector<double> errors);

/// The share of `values` that is at most `limit`; NaN if there are none.
[[nodiscard]] double share_within(const std::vector<double>& values, double limit);

/// The median; NaN if there are no values.
[[nodiscard]] double median_of(std::vector<double> values);

/// The scored interval on the observer's clock, both ends included.
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
  /// Normalized estimation error squared, one per row with a positive definite covariance. Six
  /// degrees of freedom: for a consistent estimator the median is 5.35, and 95 % lie below
  /// `kNees95`.
  std::vector<double> nees;
  /// Number of times that the pose was wrong for more than a second: an error above ten sigma,
  /// above 1 m, or above 20 deg. No pose with such a sigma may be published.
  std::size_t divergences = 0;
  GrossErrorsByMode gross_errors;     ///< position beyond five sigma
  std::size_t bad_covariances = 0;    ///< rows whose covariance is not positive definite
  Duration max_age{};                 ///< greatest `published - stamp`
  std::optional<Duration> first_row;  ///< the very first row's stamp since `start`
};

/// Truth of the pair at an instant of the observer's clock.
using RelativeTruth = std::function<std::optional<Pose>(Timestamp)>;

/// Scores `poses` (stamps increase) inside `window`; `start` is the start of the recording. Rows
/// without truth count only for availability.
[[nodiscard]] PairScore score_pair(std::span<const NeighborPose> poses, const RelativeTruth& truth,
                                   Timestamp start, const ScoreWindow& window);

}  // namespace crepes
