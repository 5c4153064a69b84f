/// What one pair's poses were like over time.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "estimator/core/outputs.hpp"

namespace crepes::faults {

/// A part of the time [s].
struct Span {
  double from_s = 0.0;
  double to_s = 0.0;

  [[nodiscard]] bool contains(double t_s) const { return t_s >= from_s && t_s <= to_s; }
};

/// A position or an attitude of which Mahalanobis^2 is above this is off by more than 5 sigma (one
/// in 10^7).
inline constexpr double kBeyond5Sigma = 35.0;

struct PoseError {
  double true_s = 0.0;
  double error_m = 0.0;
  double error_rad = 0.0;
  double mahalanobis2 = 0.0;  ///< of position or attitude, whichever is larger
  PoseMode mode = PoseMode::kPredicted;
};

/// Poses off by more than 5 sigma, on end.
struct Beyond {
  double longest_s = 0.0;
  double worst_m = 0.0;
  double worst_rad = 0.0;
};

class PoseTrace {
 public:
  /// `truth`: T_B_N at the pose's stamp; the pose is published at `true_s`.
  void add(const NeighborPose& pose, const Pose& truth, double true_s);

  [[nodiscard]] const std::vector<PoseError>& errors() const { return errors_; }
  [[nodiscard]] std::uint64_t not_finite() const { return not_finite_; }
  /// Poses whose covariance is none, or says that the pose should not have been published.
  [[nodiscard]] std::uint64_t unusable() const { return unusable_; }
  /// Of all poses, to the bit.
  [[nodiscard]] std::uint64_t hash() const { return hash_; }

  [[nodiscard]] Beyond beyond(const Span& span) const;
  [[nodiscard]] double count(const Span& span) const;
  /// Root mean square; 0 without poses.
  [[nodiscard]] double rmse_m(const Span& span) const;
  [[nodiscard]] double rmse_rad(const Span& span) const;
  [[nodiscard]] double worst_m(const Span& span) const;
  /// The longest time without a pose.
  [[nodiscard]] double longest_absence_s(const Span& span) const;
  /// When the last 0.3 s ends that have no pose, or a mean square error above this; `span.from_s`
  /// if there is none.
  [[nodiscard]] double recovered_at_s(const Span& span, double rmse_m) const;

 private:
  [[nodiscard]] double rmse(const Span& span, double PoseError::*error) const;

  std::vector<PoseError> errors_;
  std::uint64_t not_finite_ = 0;
  std::uint64_t unusable_ = 0;
  std::uint64_t hash_ = 0;
};

}  // namespace crepes::faults
