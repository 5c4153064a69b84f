/// The correction step of every filter here: gate, gain, Joseph form.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "estimator/core/outputs.hpp"

namespace crepes {

/// A measurement linearized at the current state:  residual = z - h(x),  H = dh/d(error).
template <int M, int N>
struct Innovation {
  Eigen::Matrix<double, M, 1> residual;
  Eigen::Matrix<double, M, N> H;
  Eigen::Matrix<double, M, M> cov_z;
};

template <int M, int N>
struct UpdateOutcome {
  Verdict verdict = Verdict::kDegenerate;
  double nis = 0.0;  ///< residual^T S^-1 residual
  Eigen::Matrix<double, M, 1> sigma = Eigen::Matrix<double, M, 1>::Zero();  ///< sqrt(S_ii)
  Eigen::Matrix<double, N, 1> correction = Eigen::Matrix<double, N, 1>::Zero();
};

/// Corrects P by Joseph's form  (I - KH) P (I - KH)^T + K V K^T, written so that it costs N^2 M;
/// the correction is left for the caller to inject. A NIS above `gate_nis` changes nothing.
template <int M, int N>
[[nodiscard]] UpdateOutcome<M, N> kalman_update(const Innovation<M, N>& z, double gate_nis,
                                                Eigen::Matrix<double, N, N>& P) {
  const Eigen::Matrix<double, N, M> PHt = P * z.H.transpose();
  const Eigen::Matrix<double, M, M> S = z.H * PHt + z.cov_z;
  const Eigen::LLT<Eigen::Matrix<double, M, M>> S_chol(S);
  if (S_chol.info() != Eigen::Success) return {};
  const double nis = z.residual.dot(S_chol.solve(z.residual));
  const Eigen::Matrix<double, M, 1> sigma = S.diagonal().cwiseSqrt();
  if (!(nis <= gate_nis)) return {Verdict::kGated, nis, sigma, Eigen::Matrix<double, N, 1>::Zero()};

  const Eigen::Matrix<double, N, M> K = S_chol.solve(PHt.transpose()).transpose();
  P.noalias() -= K * PHt.transpose();                            // (I - KH) P
  const Eigen::Matrix<double, N, M> rest = P * z.H.transpose();  // (I - KH) P H^T
  P.noalias() -= (rest - K * z.cov_z) * K.transpose();
  P = (0.5 * (P + P.transpose())).eval();
  return {Verdict::kFused, nis, sigma, K * z.residual};
}

/// What there is to tell of an update.
template <int M, int N>
[[nodiscard]] Fusion fusion_of(const Innovation<M, N>& z, const UpdateOutcome<M, N>& outcome) {
  Fusion fusion{
      .verdict = outcome.verdict, .nis = outcome.nis, .dimension = M, .residual{}, .sigma{}};
  Eigen::Matrix<double, M, 1>::Map(fusion.residual.data()) = z.residual;
  Eigen::Matrix<double, M, 1>::Map(fusion.sigma.data()) = outcome.sigma;
  return fusion;
}

}  // namespace crepes
