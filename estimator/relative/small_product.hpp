/// Matrix products with few columns: most of the run time of the tight filter.
#pragma once

#include <Eigen/Core>

namespace crepes {

using MatrixRef = Eigen::Ref<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
using ConstMatrixRef = Eigen::Ref<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

/// C += A B^T, with the widest vectors of the processor. The result is the same to the bit for any
/// width: each element of C sums in the order of A's columns. C must not overlap A or B.
void add_product(const ConstMatrixRef& A, const ConstMatrixRef& B, MatrixRef C);
/// C -= A B^T, likewise.
void subtract_product(const ConstMatrixRef& A, const ConstMatrixRef& B, MatrixRef C);

/// `add_product` with vectors of two lanes, for tests on processors with wider ones.
void add_product_narrow(const ConstMatrixRef& A, const ConstMatrixRef& B, MatrixRef C);

}  // namespace crepes
