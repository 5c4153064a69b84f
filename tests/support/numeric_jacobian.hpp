/// Derivatives by central differences, to hold analytic Jacobians against.
#pragma once

#include <Eigen/Core>

namespace crepes::test {

/// d f / d d  at d = 0, for f: R^N -> R^M. With the default step and functions of size one both
/// truncation (h^2) and rounding (eps / h) stay near 1e-10.
template <int M, int N, class F>
[[nodiscard]] Eigen::Matrix<double, M, N> numeric_jacobian(const F& f, double step = 1e-5) {
  Eigen::Matrix<double, M, N> J;
  for (int i = 0; i < N; ++i) {
    const Eigen::Matrix<double, N, 1> d = step * Eigen::Matrix<double, N, 1>::Unit(i);
    const Eigen::Matrix<double, M, 1> high = f(d);
    const Eigen::Matrix<double, M, 1> low = f(-d);
    J.col(i) = (high - low) / (2.0 * step);
  }
  return J;
}

/// Largest absolute entry of `a - b`.
template <class A, class B>
[[nodiscard]] double largest_difference(const Eigen::MatrixBase<A>& a,
                                        const Eigen::MatrixBase<B>& b) {
  return (a - b).cwiseAbs().maxCoeff();
}

}  // namespace crepes::test
