/// The correction by a range: of second order across the line of sight, and robust.
#pragma once

#include "estimator/relative/range_measurement.hpp"

namespace crepes {

/// Density of ranges without line of sight that were not recognized, for each true range [1/m]. The
/// same for the pairs' filters, their hypotheses and the team's filter.
inline constexpr double kFalseRangeDensity = 0.05;

/// The probability that a range is true, by its innovation and the variance that is expected of it
/// (probabilistic data association, Bar-Shalom and Tse 1975). Below one half it is refused.
[[nodiscard]] double probability_true(double innovation_m, double variance_m2);

struct RangeUpdate {
  Fusion fusion;
  ErrorState::Vector correction = ErrorState::Vector::Zero();  ///< to be injected
};

/// Corrects P by a range, linearized at antennas `distance_m` apart. `shared_m2` is the variance of
/// an error that all these ranges have in common and that is no state: however many there are, the
/// range is not known better afterwards (compare a consider state, Schmidt 1966).
[[nodiscard]] RangeUpdate update_by_range(const RangeInnovation& z, double distance_m,
                                          double gate_nis, ErrorState::Covariance& P,
                                          double shared_m2 = 0.0);

}  // namespace crepes
