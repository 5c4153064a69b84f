#include "estimator/relative/range_update.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace crepes {
namespace {

using E = ErrorState;

// Where the curvature's variance exceeds this share of the range's, ranges correct along the line.
constexpr double kMaxCurvature = 0.1;

// What a range says of the distance depends on the direction. Where that is less certain than this,
// both axes together, ranges correct nothing.
constexpr double kLostDirection = 0.15;  // rad

// The part of a position's covariance across the line of sight.
Eigen::Matrix3d covariance_across(const Eigen::RowVector3d& line, const Eigen::Matrix3d& cov_p) {
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - line.transpose() * line;
  return across * cov_p * across;
}

// The part of a gain that acts on distance and range bias.
E::Vector along_line(const E::Vector& gain, const Eigen::RowVector3d& line) {
  E::Vector along = E::Vector::Zero();
  for (const int index : {E::kP, E::kV})
    along.segment<3>(index) = line.transpose() * (line * gain.segment<3>(index));
  along(E::kRangeBias) = gain(E::kRangeBias);
  return along;
}

}  // namespace

double probability_true(double innovation_m, double variance_m2) {
  const double nis = innovation_m * innovation_m / variance_m2;
  const double density = std::exp(-0.5 * nis) / std::sqrt(2.0 * std::numbers::pi * variance_m2);
  return density / (density + kFalseRangeDensity);
}

bool is_range_accepted(double innovation_m, double variance_m2, double gate_nis) {
  return innovation_m * innovation_m / variance_m2 <= gate_nis &&
         probability_true(innovation_m, variance_m2) >= 0.5;
}

RangeUpdate update_by_range(const RangeInnovation& z, double distance_m, double gate_nis,
                            E::Covariance& P, double shared_m2) {
  const Eigen::RowVector3d line = z.H.middleCols<3>(E::kP);
  const Eigen::Matrix3d across = covariance_across(line, P.block<E::kP, E::kP, 3, 3>());
  const RangeCurvature curvature = curvature_of(across, distance_m);
  const double curved = curvature.variance_m2;
  const E::Vector PHt = P.seen_columns().lazyProduct(z.H.transpose());
  const double predicted = z.H * PHt.head<E::kSeen>();
  const double residual = z.residual(0) - curvature.mean_m;
  const double shared = curved + shared_m2;
  const double expected = predicted + z.cov_z(0, 0) + shared;

  RangeUpdate update;
  Fusion& fusion = update.fusion;
  fusion.dimension = 1;
  fusion.nis = residual * residual / expected;
  fusion.log_likelihood = -0.5 * (fusion.nis + std::log(2.0 * std::numbers::pi * expected));
  fusion.residual[0] = residual;
  fusion.sigma[0] = std::sqrt(expected);
  const double is_true = probability_true(residual, expected);
  const bool fits = is_range_accepted(residual, expected, gate_nis);
  fusion.verdict = fits ? Verdict::kFused : Verdict::kGated;
  const bool is_lost = across.trace() > std::pow(kLostDirection * distance_m, 2);
  if (fusion.verdict == Verdict::kGated || predicted <= shared || is_lost) return update;

  // The error across hardly changes between ranges, so that their curvature does not average out.
  // The variance after the update is at least that of the curvature and of what is shared (compare
  // a consider state, Schmidt 1966). Otherwise ranges make a direction known that they do not
  // depend on.
  const double variance =
      std::max(z.cov_z(0, 0) + shared, predicted * shared / (predicted - shared));
  const E::Vector G = PHt / std::sqrt(predicted + variance);
  const double white = residual / std::sqrt(predicted + variance);

  // Mean and covariance of the mixture (probabilistic data association, Bar-Shalom and Tse 1975):
  // with the range P - G G^T, without it P, and both means apart.
  const double apart = is_true * (1.0 - is_true) * white * white;
  if (curved <= kMaxCurvature * z.cov_z(0, 0)) {
    P.subtract_outer((is_true - apart) * G, G);
    update.correction = is_true * white * G;
    return update;
  }
  const E::Vector used = along_line(G, line);
  const E::Vector unused = G - used;
  P.subtract_outer(is_true * G, G);  // any gain: P - G G^T + (G - used) (G - used)^T
  P.subtract_outer(-is_true * unused, unused);
  P.subtract_outer(-apart * used, used);
  update.correction = is_true * white * used;
  return update;
}

}  // namespace crepes
