/// The correction by a range: of second order across the line of sight, and robust.
#pragma once

#include "estimator/relative/range_measurement.hpp"

namespace crepes {

/// Density of ranges without line of sight that were not recognized, for each true range [1/m]. The
/// same for the pairs' filters, their hypotheses and the team's filter.
inline constexpr double kFalseRangeDensity = 0.05;

struct RangeUpdate {
  Fusion fusion;
  ErrorState::Vector correction = ErrorState::Vector::Zero();  ///< to be injected
};

/// Corrects P by a range, linearized at antennas `distance_m` apart.
[[nodiscard]] RangeUpdate update_by_range(const RangeInnovation& z, double distance_m,
                                          double gate_nis, ErrorState::Covariance& P);

}  // namespace crepes
