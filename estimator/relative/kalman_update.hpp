/// The correction step of every filter here: gate, gain, Joseph form.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <array>
#include <cmath>
#include <numbers>
#include <tuple>

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
  double nis = 0.0;             ///< residual^T S^-1 residual
  double log_likelihood = 0.0;  ///< -(NIS + ln |2 pi S|) / 2
  Eigen::Matrix<double, M, 1> sigma = Eigen::Matrix<double, M, 1>::Zero();  ///< sqrt(S_ii)
  Eigen::Matrix<double, N, 1> correction = Eigen::Matrix<double, N, 1>::Zero();
  Eigen::Matrix<double, N, M> K = Eigen::Matrix<double, N, M>::Zero();
  Eigen::Matrix<double, N, M> L = Eigen::Matrix<double, N, M>::Zero();  ///< P H^T - K S / 2
};

/// What an innovation asks for; P is as before, and the correction left for the caller to inject. A
/// NIS above `gate_nis` asks for nothing.
template <int M, int N>
[[nodiscard]] UpdateOutcome<M, N> kalman_gain(const Innovation<M, N>& z, double gate_nis,
                                              const Eigen::Matrix<double, N, N>& P) {
  // A measurement sees few of the states: most of H is zero. By stripes that registers hold.
  std::array<int, N> seen{};
  int count = 0;
  for (int i = 0; i < N; ++i)
    if (!z.H.col(i).isZero(0.0)) seen[count++] = i;
  constexpr int kStripe = N % 16 == 0 ? 16 : N;
  Eigen::Matrix<double, N, M> PHt;
  for (int row = 0; row < N; row += kStripe) {
    for (int m = 0; m < M; ++m) {
      Eigen::Matrix<double, kStripe, 1> sum = Eigen::Matrix<double, kStripe, 1>::Zero();
      for (int k = 0; k < count; ++k)
        sum += z.H(m, seen[k]) * P.col(seen[k]).template segment<kStripe>(row);
      PHt.col(m).template segment<kStripe>(row) = sum;
    }
  }
  const Eigen::Matrix<double, M, M> S = z.H.lazyProduct(PHt) + z.cov_z;
  const Eigen::LLT<Eigen::Matrix<double, M, M>> S_chol(S);
  if (S_chol.info() != Eigen::Success) return {};
  UpdateOutcome<M, N> outcome;
  outcome.nis = z.residual.dot(S_chol.solve(z.residual));
  const double log_det = 2.0 * S_chol.matrixLLT().diagonal().array().log().sum();
  outcome.log_likelihood = -0.5 * (outcome.nis + log_det + M * std::log(2.0 * std::numbers::pi));
  outcome.sigma = S.diagonal().cwiseSqrt();
  if (!(outcome.nis <= gate_nis)) {
    outcome.verdict = Verdict::kGated;
    return outcome;
  }
  outcome.verdict = Verdict::kFused;
  const Eigen::Matrix<double, M, M> S_inverse =
      S_chol.solve(Eigen::Matrix<double, M, M>::Identity());
  outcome.K = PHt.lazyProduct(S_inverse);
  outcome.L = PHt - outcome.K.lazyProduct(0.5 * S);
  outcome.correction = outcome.K.lazyProduct(z.residual);
  return outcome;
}

/// Joseph's form  (I - KH) P (I - KH)^T + K V K^T  multiplied out,  P - K L^T - L K^T:  holds
/// for a gain that is not quite the best, costs N^2 M and stays symmetric to the bit. By blocks,
/// each written together with its mirror image.
template <int M, int N>
void correct_covariance(const UpdateOutcome<M, N>& outcome, Eigen::Matrix<double, N, N>& P) {
  constexpr int kBlock = N % 4 == 0 ? 4 : N % 3 == 0 ? 3 : 1;
  const auto& [K, L] = std::tie(outcome.K, outcome.L);
  for (int j = 0; j < N; j += kBlock) {
    const auto K_j = K.template middleRows<kBlock>(j);
    const auto L_j = L.template middleRows<kBlock>(j);
    for (int i = j; i < N; i += kBlock) {
      Eigen::Matrix<double, kBlock, kBlock> block = P.template block<kBlock, kBlock>(i, j);
      for (int m = 0; m < M; ++m) {
        block -= K.col(m).template segment<kBlock>(i) * L_j.col(m).transpose() +
                 L.col(m).template segment<kBlock>(i) * K_j.col(m).transpose();
      }
      P.template block<kBlock, kBlock>(i, j) = block;
      if (i != j) P.template block<kBlock, kBlock>(j, i) = block.transpose();
    }
  }
}

/// Both at once.
template <int M, int N>
[[nodiscard]] UpdateOutcome<M, N> kalman_update(const Innovation<M, N>& z, double gate_nis,
                                                Eigen::Matrix<double, N, N>& P) {
  auto outcome = kalman_gain(z, gate_nis, P);
  if (outcome.verdict == Verdict::kFused) correct_covariance(outcome, P);
  return outcome;
}

/// What there is to tell of an update.
template <int M, int N>
[[nodiscard]] Fusion fusion_of(const Innovation<M, N>& z, const UpdateOutcome<M, N>& outcome) {
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
