#include "estimator/relative/small_product.hpp"

#include <gtest/gtest.h>

#include "tests/support/random_geometry.hpp"

namespace crepes::small_product_test {
namespace {

Eigen::MatrixXd random_matrix(test::RandomGeometry& random, Eigen::Index rows,
                              Eigen::Index columns) {
  Eigen::MatrixXd matrix(rows, columns);
  for (double& x : matrix.reshaped()) x = random.normal();
  return matrix;
}

/// One element after the other, its sum in the order of the columns.
Eigen::MatrixXd sum_of_products(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B,
                                Eigen::MatrixXd C, double sign) {
  for (Eigen::Index i = 0; i < C.rows(); ++i)
    for (Eigen::Index j = 0; j < C.cols(); ++j)
      for (Eigen::Index k = 0; k < A.cols(); ++k) C(i, j) += sign * B(j, k) * A(i, k);
  return C;
}

TEST(SmallProduct, IsThePlainSumToTheBitForAllSizesInAnyWidth) {
  test::RandomGeometry random(1);
  for (Eigen::Index rows = 1; rows <= 20; ++rows) {
    for (Eigen::Index columns = 1; columns <= 8; ++columns) {
      for (const Eigen::Index inner : {0, 1, 2, 3, 16}) {
        const Eigen::MatrixXd A = random_matrix(random, rows, inner);
        const Eigen::MatrixXd B = random_matrix(random, columns, inner);
        const Eigen::MatrixXd C = random_matrix(random, rows, columns);

        Eigen::MatrixXd sum = C;
        add_product(A, B, sum);
        Eigen::MatrixXd narrow_sum = C;
        add_product_narrow(A, B, narrow_sum);
        Eigen::MatrixXd difference = C;
        subtract_product(A, B, difference);

        ASSERT_EQ(sum, sum_of_products(A, B, C, 1.0)) << rows << " " << columns << " " << inner;
        ASSERT_EQ(narrow_sum, sum);
        ASSERT_EQ(difference, sum_of_products(A, B, C, -1.0));
      }
    }
  }
}

TEST(SmallProduct, TouchesNothingAroundABlock) {
  test::RandomGeometry random(2);
  Eigen::MatrixXd whole = random_matrix(random, 40, 12);
  const Eigen::MatrixXd before = whole;

  add_product(whole.block(1, 0, 17, 3), before.block(0, 5, 4, 3), whole.block(21, 6, 17, 4));

  Eigen::MatrixXd expected = before;
  expected.block(21, 6, 17, 4) = sum_of_products(
      before.block(1, 0, 17, 3), before.block(0, 5, 4, 3), before.block(21, 6, 17, 4), 1.0);
  EXPECT_EQ(whole, expected);
}

TEST(SmallProduct, OfAMatrixWithItselfIsSymmetricToTheBit) {
  test::RandomGeometry random(3);
  const Eigen::MatrixXd G = random_matrix(random, 37, 6);
  Eigen::MatrixXd P = Eigen::MatrixXd::Identity(37, 37);

  subtract_product(G, G, P);

  EXPECT_EQ(P, P.transpose());
}

}  // namespace
}  // namespace crepes::small_product_test
