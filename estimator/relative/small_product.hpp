/// The products that the tight filter spends its time in: of a few columns each.
#pragma once

#include <Eigen/Core>

namespace crepes {

using MatrixRef = Eigen::Ref<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
using ConstMatrixRef = Eigen::Ref<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

/// C += A B^T, in vectors as wide as the processor has, with the same result to the bit in any
/// width: each element of C sums in the order of A's columns. C shares none with A or B.
void add_product(const ConstMatrixRef& A, const ConstMatrixRef& B, MatrixRef C);
/// C -= A B^T, likewise.
void subtract_product(const ConstMatrixRef& A, const ConstMatrixRef& B, MatrixRef C);

/// `add_product` as processors do it whose vectors have two lanes, so that tests see it on others.
void add_product_narrow(const ConstMatrixRef& A, const ConstMatrixRef& B, MatrixRef C);

}  // namespace crepes
