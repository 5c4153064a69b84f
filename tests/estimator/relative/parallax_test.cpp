#include "estimator/relative/parallax.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "tests/support/random_geometry.hpp"

namespace crepes::parallax_test {
namespace {

using E = ErrorState;
using Full = E::Covariance::Full;

/// Of a neighbor whose direction is known to 1 mrad, whose distance only with the range's bias.
Full covariance_of(test::RandomGeometry& random, const Eigen::Vector3d& p_B_N) {
  E::Vector sigma = E::Vector::Constant(1e-3);
  sigma.segment<3>(E::kP).setConstant(1e-3 * p_B_N.norm());
  Full P = sigma.cwiseAbs2().asDiagonal();
  E::Vector bias = E::Vector::Zero();  // and all that errs with it
  bias.segment<3>(E::kP) = -p_B_N.normalized();
  bias(E::kRangeBias) = 1.0;
  bias.tail<3>() = random.normal_vector<3>(1e-3);
  P += 0.1 * 0.1 * bias * bias.transpose();
  return P;
}

BearingInnovation bearing_of(const Eigen::Vector3d& p_B_N) {
  NominalState state;
  state.motion.T_B_N.p = p_B_N;
  const Eigen::Vector3d seen = p_B_N.normalized() + 1e-3 * p_B_N.unitOrthogonal();
  return *linearize_bearing(state, seen.normalized(), {}, {}, 5e-4);
}

double along(const Full& P, const Eigen::Vector3d& p_B_N) {
  const Eigen::Vector3d u = p_B_N.normalized();
  return u.dot(P.block<3, 3>(E::kP, E::kP) * u);
}

constexpr double kAll = 1e9;  // gate

// The covariance is turned against the line of sight by what the filter does not know of it.
TEST(Parallax, OfTheFiltersOwnErrorTellsNothing) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    test::RandomGeometry random(seed);
    const Eigen::Vector3d p_B_N = random.vector(2.0);
    const Eigen::Vector3d jittered = p_B_N + 1e-3 * p_B_N.norm() * p_B_N.unitOrthogonal();
    const Full P = covariance_of(random, jittered);
    E::Covariance partitioned(P);
    const BearingInnovation z = bearing_of(p_B_N);
    auto outcome = kalman_gain(z, kAll, partitioned);
    const double before = outcome.correction(E::kRangeBias);

    const E::Vector withheld = withhold_distance(z, p_B_N, partitioned, outcome);
    correct_covariance(outcome, withheld, partitioned);

    const Eigen::Vector3d u = p_B_N.normalized();
    EXPECT_GT(std::abs(before), 1e-5) << seed;
    EXPECT_NEAR(u.dot(outcome.correction.segment<3>(E::kP)), 0.0, 1e-12) << seed;
    EXPECT_LT(std::abs(outcome.correction(E::kRangeBias)), 0.01 * std::abs(before)) << seed;
    const Full after = partitioned.full();
    EXPECT_NEAR(along(after, p_B_N), along(P, p_B_N), 1e-9 * along(P, p_B_N)) << seed;
    EXPECT_EQ(Eigen::LLT<Full>(after).info(), Eigen::Success) << seed;
  }
}

TEST(Parallax, OfAMotionTellsTheDistance) {
  test::RandomGeometry random(1);
  const Eigen::Vector3d p_B_N(2.0, 0.5, 0.1);
  const Eigen::Vector3d moved = p_B_N + 0.1 * p_B_N.unitOrthogonal();
  const Full P = covariance_of(random, moved);
  E::Covariance partitioned(P);
  const BearingInnovation z = bearing_of(p_B_N);
  auto outcome = kalman_gain(z, kAll, partitioned);
  const double before = outcome.correction(E::kRangeBias);
  E::Covariance whole = partitioned;
  correct_covariance(outcome, whole);

  const E::Vector withheld = withhold_distance(z, p_B_N, partitioned, outcome);
  correct_covariance(outcome, withheld, partitioned);

  EXPECT_NEAR(outcome.correction(E::kRangeBias), before, 0.02 * std::abs(before));
  EXPECT_LT(along(partitioned.full(), p_B_N), 0.5 * along(P, p_B_N));
  EXPECT_LT(along(partitioned.full(), p_B_N), 1.02 * along(whole.full(), p_B_N));
}

/// The distance's part of the gain K is missing; the rest of it obeys Joseph's form.
TEST(Parallax, WithholdsByJosephsForm) {
  test::RandomGeometry random(2);
  const Eigen::Vector3d p_B_N(1.0, -0.5, 0.3);
  const Full P = covariance_of(random, p_B_N + 5e-4 * p_B_N.unitOrthogonal());
  E::Covariance partitioned(P);
  const BearingInnovation z = bearing_of(p_B_N);
  auto outcome = kalman_gain(z, kAll, partitioned);
  Eigen::Matrix<double, 2, E::kSize> H = Eigen::Matrix<double, 2, E::kSize>::Zero();
  H.leftCols<E::kSeen>() = z.H;
  const Eigen::Matrix2d S = H * P * H.transpose() + z.cov_z;
  E::Vector distance = E::Vector::Zero();
  distance.segment<3>(E::kP) = p_B_N.normalized();
  Eigen::Matrix<double, E::kSize, 2> K = P * H.transpose() * S.inverse();
  K -= (P * distance / distance.dot(P * distance) * (distance.transpose() * K)).eval();
  const Full rest = Full::Identity() - K * H;
  const Full expected = rest * P * rest.transpose() + K * z.cov_z * K.transpose();

  const E::Vector withheld = withhold_distance(z, p_B_N, partitioned, outcome);
  correct_covariance(outcome, withheld, partitioned);

  EXPECT_LT((outcome.correction - K * z.residual).norm(), 1e-9 * (K * z.residual).norm());
  EXPECT_LT((partitioned.full() - expected).norm(), 1e-9 * expected.norm());
}

}  // namespace
}  // namespace crepes::parallax_test
