#include "estimator/relative/parallax.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/relative/small_product.hpp"

namespace crepes {
namespace {

using E = ErrorState;

constexpr double kSignificant = 3.0;  // sigmas of the direction

}  // namespace

E::Vector withhold_distance(const BearingInnovation& z, const Eigen::Vector3d& p_B_N,
                            const E::Covariance& P, UpdateOutcome<2, E::kSize>& outcome) {
  const double rho = p_B_N.norm();
  if (!(rho > 0.0)) return E::Vector::Zero();
  const Eigen::Vector3d u = p_B_N / rho;
  const E::Vector with_distance = P.columns<E::kP, 3>() * u;
  const double variance = u.dot(with_distance.segment<3>(E::kP));
  // By how much the direction errs for each unit of the distance's relative error, and besides.
  const Eigen::Vector2d parallax = rho / variance * z.H.lazyProduct(with_distance.head<E::kSeen>());
  const Eigen::Matrix<double, 2, E::kSeen> HP = z.H.lazyProduct(P.seen());
  const double along = parallax.dot(HP.lazyProduct(z.H.transpose()) * parallax);
  const double parallax2 = parallax.squaredNorm();
  const double noise = std::max(0.0, along - std::pow(parallax2 / rho, 2) * variance);
  const double least = kSignificant * kSignificant * noise;
  const double withheld = parallax2 * parallax2 > least ? least / (parallax2 * parallax2) : 1.0;

  const E::Vector by_distance = with_distance / variance;
  outcome.correction -= withheld * u.dot(outcome.correction.segment<3>(E::kP)) * by_distance;
  return withheld * (u.transpose() * outcome.G.middleRows<3>(E::kP)).norm() * by_distance;
}

void correct_covariance(const UpdateOutcome<2, E::kSize>& outcome, const E::Vector& withheld,
                        E::Covariance& P) {
  using Columns = Eigen::Matrix<double, E::kSize, 3>;
  const Columns removed = (Columns() << outcome.G, -withheld).finished();
  const Columns factor = (Columns() << outcome.G, withheld).finished();
  subtract_product(removed, factor.topRows<E::kSeen>(), P.seen_columns());
  constexpr int kHidden = E::kSize - E::kSeen;
  subtract_product(removed.bottomRows<kHidden>(), factor.bottomRows<kHidden>(), P.hidden());
}

}  // namespace crepes
