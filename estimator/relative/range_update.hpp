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

/// Whether a range is used: its NIS is at most `gate_nis`, and it is more likely true than false.
[[nodiscard]] bool is_range_accepted(double innovation_m, double variance_m2, double gate_nis);

/// Mean and variance of the second-order term of a range.
struct RangeCurvature {
  double mean_m = 0.0;
  double variance_m2 = 0.0;
};
/// Of |dp|^2 / (2 distance), with dp a Gaussian error of the position across the line of sight
/// (second-order filter, Jazwinski 1970; Bar-Shalom, Li and Kirubarajan 2001, 10.3). `across` is
/// the covariance of dp [m^2], in any axes.
template <class Covariance>
[[nodiscard]] RangeCurvature curvature_of(const Covariance& across, double distance_m) {
  return {.mean_m = 0.5 * across.trace() / distance_m,
          .variance_m2 = 0.5 * across.squaredNorm() / (distance_m * distance_m)};
}

/// The correction by a range, and what became of it.
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
