/// Poses that are further off than their covariance allows: position errors beyond five sigma.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "estimator/core/outputs.hpp"

namespace crepes {

/// Limit of the squared Mahalanobis distance of a position. A consistent estimator exceeds it once
/// in eight million poses (chi-square, 3 degrees of freedom).
inline constexpr double kGrossMahalanobis2 = 35.0;

/// Of a set of poses.
struct GrossErrors {
  std::size_t poses = 0;               ///< with truth
  std::size_t beyond = 0;              ///< position further off than five sigma
  Duration longest_run{};              ///< of successive poses of one pair beyond it
  double max_position_m = 0.0;         ///< largest position error, beyond or not
  [[nodiscard]] double share() const;  ///< `beyond` of `poses`; NaN if there are none
};

/// Of all poses, and by mode.
struct GrossErrorsByMode {
  GrossErrors all;
  std::array<GrossErrors, 3> modes{};  ///< by PoseMode
};

/// Adds `more`, the errors of other pairs.
void merge(GrossErrorsByMode& errors, const GrossErrorsByMode& more);

/// Collects the poses of one pair in order of time. Each pose of a run counts for one period of 20
/// ms. A pose within five sigma, or half a second without poses, ends a run. A run of one mode also
/// ends where the mode changes.
class GrossErrorCounter {
 public:
  /// `mahalanobis2` of the position alone; NaN, without a valid covariance, counts as beyond.
  void add(Timestamp stamp, PoseMode mode, double position_m, double mahalanobis2);
  [[nodiscard]] const GrossErrorsByMode& errors() const { return errors_; }

 private:
  std::optional<Timestamp> begin_;  ///< of the present run
  std::optional<Timestamp> mode_begin_;
  PoseMode mode_{};
  Timestamp last_{};
  GrossErrorsByMode errors_;
};

}  // namespace crepes
