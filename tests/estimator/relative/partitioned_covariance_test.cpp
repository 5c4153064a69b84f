#include "estimator/relative/partitioned_covariance.hpp"

#include <gtest/gtest.h>

#include "tests/support/random_geometry.hpp"

namespace crepes::partitioned_covariance_test {
namespace {

constexpr int kS = 4;
constexpr int kN = 9;
using Partitioned = PartitionedCovariance<kS, kN>;

Partitioned::Full random_full(std::uint64_t seed) {
  test::RandomGeometry random(seed);
  Partitioned::Full P = random.covariance<kN>(1.0);
  return 0.5 * (P + P.transpose());
}

TEST(PartitionedCovariance, KeepsASymmetricMatrix) {
  const Partitioned::Full P = random_full(1);

  const Partitioned partitioned(P);

  EXPECT_EQ(partitioned.full(), P);
  EXPECT_EQ(partitioned.diagonal(), P.diagonal());
  EXPECT_EQ(partitioned.seen(), (P.topLeftCorner<kS, kS>()));
  EXPECT_EQ(partitioned.cross(), (P.bottomLeftCorner<kN - kS, kS>()));
  EXPECT_EQ(partitioned.hidden(), (P.bottomRightCorner<kN - kS, kN - kS>()));
}

TEST(PartitionedCovariance, StartsAtZero) { EXPECT_TRUE(Partitioned{}.full().isZero()); }

TEST(PartitionedCovariance, SetsABlockWithItsMirrorImage) {
  const Eigen::Matrix<double, 2, 3> block = Eigen::Matrix<double, 2, 3>::Random();
  const auto expect_block = [&](const Partitioned& P, int row, int column) {
    EXPECT_EQ((P.full().block<2, 3>(row, column)), block);
    EXPECT_EQ((P.full().block<3, 2>(column, row)), block.transpose());
  };
  Partitioned seen_with_hidden;
  seen_with_hidden.set_symmetric<1, 5>(block);
  expect_block(seen_with_hidden, 1, 5);
  Partitioned hidden_with_seen;
  hidden_with_seen.set_symmetric<5, 1>(block);
  expect_block(hidden_with_seen, 5, 1);
  Partitioned both_hidden;
  both_hidden.set_symmetric<4, 6>(block);
  expect_block(both_hidden, 4, 6);
}

TEST(PartitionedCovariance, MakesStatesIndependent) {
  Partitioned P(random_full(2));

  P.set_independent<1, 2>(0.25);

  Partitioned::Full expected = random_full(2);
  expected.middleRows<2>(1).setZero();
  expected.middleCols<2>(1).setZero();
  expected.diagonal().segment<2>(1).setConstant(0.25);
  EXPECT_EQ(P.full(), expected);
}

TEST(PartitionedCovariance, SubtractsAnOuterProduct) {
  const Eigen::Matrix<double, kN, 1> g = Eigen::Matrix<double, kN, 1>::Random();
  Partitioned P(random_full(3));

  P.subtract_outer(2.0 * g, g);

  EXPECT_TRUE(P.full().isApprox(random_full(3) - 2.0 * g * g.transpose(), 1e-12));
}

}  // namespace
}  // namespace crepes::partitioned_covariance_test
