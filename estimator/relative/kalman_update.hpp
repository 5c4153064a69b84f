/// The correction step of every filter here: gate, gain, covariance.
///
/// Measurements see the first S of the N states. P is symmetric, and where S < N it is not kept
/// twice: right of its first S columns, its first S rows are neither read nor written.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>
#include <numbers>

#include "estimator/core/outputs.hpp"
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

/// What an innovation asks for; P is as before, and the correction left for the caller to inject. A
/// NIS above `gate_nis` asks for nothing.
template <int M, int S, int N>
[[nodiscard]] UpdateOutcome<M, N> kalman_gain(const Innovation<M, S>& z, double gate_nis,
                                              const Eigen::Matrix<double, N, N>& P) {
  Eigen::Matrix<double, N, M> PHt = Eigen::Matrix<double, N, M>::Zero();
  add_product(P.template leftCols<S>(), z.H, PHt);
  const Eigen::LLT<Eigen::Matrix<double, M, M>> C(z.H.lazyProduct(PHt.template topRows<S>()) +
                                                  z.cov_z);
  if (C.info() != Eigen::Success) return {};
  const Eigen::Matrix<double, M, M> C_inverse =
      C.matrixL().solve(Eigen::Matrix<double, M, M>::Identity());
  const Eigen::Matrix<double, M, 1> white = C_inverse * z.residual;
  UpdateOutcome<M, N> outcome;
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

/// P - G G^T: what Joseph's form  (I - KH) P (I - KH)^T + K cov_z K^T  comes to for the gain
/// K = G C^-1. It costs N^2 M, and both halves of P come out alike to the bit.
template <int S, int M, int N>
void correct_covariance(const UpdateOutcome<M, N>& outcome, Eigen::Matrix<double, N, N>& P) {
  subtract_product(outcome.G, outcome.G.template topRows<S>(), P.template leftCols<S>());
  if constexpr (S < N) {
    const auto rest = outcome.G.template bottomRows<N - S>();
    subtract_product(rest, rest, P.template bottomRightCorner<N - S, N - S>());
  }
}

/// Both at once.
template <int M, int S, int N>
[[nodiscard]] UpdateOutcome<M, N> kalman_update(const Innovation<M, S>& z, double gate_nis,
                                                Eigen::Matrix<double, N, N>& P) {
  auto outcome = kalman_gain(z, gate_nis, P);
  if (outcome.verdict == Verdict::kFused) correct_covariance<S>(outcome, P);
  return outcome;
}

/// What there is to tell of an update.
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
