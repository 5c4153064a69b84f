/// The correction step of every filter here: gate, gain, covariance.
///
/// Measurements see the first S of the N states. The covariance is a PartitionedCovariance, or a
/// matrix where S = N.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>
#include <numbers>
#include <type_traits>

#include "estimator/core/outputs.hpp"
#include "estimator/relative/partitioned_covariance.hpp"
#include "estimator/relative/small_product.hpp"

namespace crepes {

/// A measurement linearized at the current state:  residual = z - h(x),  H = dh/d(error).
template <int M, int S>
struct Innovation {
  Eigen::Matrix<double, M, 1> residual;
  Eigen::Matrix<double, M, S> H;
  Eigen::Matrix<double, M, M> cov_z;
};

/// With the innovation's covariance C C^T = H P H^T + cov_z.
template <int M, int N>
struct UpdateOutcome {
  Verdict verdict = Verdict::kDegenerate;
  double nis = 0.0;             ///< residual^T (C C^T)^-1 residual
  double log_likelihood = 0.0;  ///< -(NIS + ln |2 pi C C^T|) / 2
  Eigen::Matrix<double, M, 1> sigma = Eigen::Matrix<double, M, 1>::Zero();  ///< of the residual
  Eigen::Matrix<double, N, 1> correction = Eigen::Matrix<double, N, 1>::Zero();
  Eigen::Matrix<double, N, M> G = Eigen::Matrix<double, N, M>::Zero();  ///< P H^T C^-T
};

/// The columns of P that belong to the seen states.
template <int S, int N>
[[nodiscard]] auto seen_columns(const PartitionedCovariance<S, N>& P) {
  return P.seen_columns();
}
/// Of a plain covariance, all columns.
template <int N>
[[nodiscard]] const Eigen::Matrix<double, N, N>& seen_columns(
    const Eigen::Matrix<double, N, N>& P) {
  return P;
}

/// Gate and gain; does not change P. The caller injects the correction. If the NIS exceeds
/// `gate_nis`, the verdict is kGated and the correction zero.
template <int M, int S, class Covariance>
[[nodiscard]] auto kalman_gain(const Innovation<M, S>& z, double gate_nis, const Covariance& P) {
  constexpr int kStates = std::decay_t<decltype(seen_columns(P))>::RowsAtCompileTime;
  static_assert(std::decay_t<decltype(seen_columns(P))>::ColsAtCompileTime == S);
  Eigen::Matrix<double, kStates, M> PHt = Eigen::Matrix<double, kStates, M>::Zero();
  add_product(seen_columns(P), z.H, PHt);
  const Eigen::LLT<Eigen::Matrix<double, M, M>> C(z.H.lazyProduct(PHt.template topRows<S>()) +
                                                  z.cov_z);
  UpdateOutcome<M, kStates> outcome;
  if (C.info() != Eigen::Success) return outcome;
  const Eigen::Matrix<double, M, M> C_inverse =
      C.matrixL().solve(Eigen::Matrix<double, M, M>::Identity());
  const Eigen::Matrix<double, M, 1> white = C_inverse * z.residual;
  outcome.nis = white.squaredNorm();
  const double log_det = 2.0 * C.matrixLLT().diagonal().array().log().sum();
  outcome.log_likelihood = -0.5 * (outcome.nis + log_det + M * std::log(2.0 * std::numbers::pi));
  outcome.sigma = C.reconstructedMatrix().diagonal().cwiseSqrt();
  if (!(outcome.nis <= gate_nis)) {
    outcome.verdict = Verdict::kGated;
    return outcome;
  }
  outcome.verdict = Verdict::kFused;
  outcome.G = PHt.lazyProduct(C_inverse.transpose());
  outcome.correction = outcome.G.lazyProduct(white);
  return outcome;
}

/// P - G G^T. This equals Joseph's form  (I - KH) P (I - KH)^T + K cov_z K^T  for the optimal gain
/// K = G C^-1. It costs N^2 M, and the result is symmetric to the bit.
template <int M, int S, int N>
void correct_covariance(const UpdateOutcome<M, N>& outcome, PartitionedCovariance<S, N>& P) {
  subtract_product(outcome.G, outcome.G.template topRows<S>(), P.seen_columns());
  const auto of_hidden = outcome.G.template bottomRows<N - S>();
  subtract_product(of_hidden, of_hidden, P.hidden());
}
/// P <- P - G G^T .
template <int M, int N>
void correct_covariance(const UpdateOutcome<M, N>& outcome, Eigen::Matrix<double, N, N>& P) {
  subtract_product(outcome.G, outcome.G, P);
}

/// Gain, and correction of the covariance.
template <int M, int S, class Covariance>
[[nodiscard]] auto kalman_update(const Innovation<M, S>& z, double gate_nis, Covariance& P) {
  auto outcome = kalman_gain(z, gate_nis, P);
  if (outcome.verdict == Verdict::kFused) correct_covariance(outcome, P);
  return outcome;
}

/// The outcome of an update, for the records.
template <int M, int S, int N>
[[nodiscard]] Fusion fusion_of(const Innovation<M, S>& z, const UpdateOutcome<M, N>& outcome) {
  Fusion fusion{.verdict = outcome.verdict,
                .nis = outcome.nis,
                .log_likelihood = outcome.log_likelihood,
                .dimension = M,
                .residual{},
                .sigma{}};
  Eigen::Matrix<double, M, 1>::Map(fusion.residual.data()) = z.residual;
  Eigen::Matrix<double, M, 1>::Map(fusion.sigma.data()) = outcome.sigma;
  return fusion;
}

}  // namespace crepes
