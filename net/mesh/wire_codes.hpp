/// Compact codes of the values in a peer message. Pure functions.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "estimator/core/pose.hpp"

namespace crepes {

inline constexpr std::int64_t kDirectionUnit = 16383;  ///< code of 1
inline constexpr std::int64_t kFactorUnit = 2047;      ///< code of 1

/// The octahedral map of a unit vector (Cigolle et al. 2014, "A survey of efficient representations
/// for independent unit vectors").
[[nodiscard]] std::array<std::int64_t, 2> encode_direction(const Eigen::Vector3d& u);
/// Of components from -kDirectionUnit to kDirectionUnit.
[[nodiscard]] Eigen::Vector3d decode_direction(const std::array<std::int64_t, 2>& code);

/// Positive numbers from `min` to `max`, quantized to `steps` + 1 levels of equal ratio; numbers
/// outside are clamped.
struct LogScale {
  double min;
  double max;
  unsigned steps;

  /// The nearest code.
  [[nodiscard]] unsigned encode(double value) const;
  /// The value of a code.
  [[nodiscard]] double decode(unsigned code) const;
};

/// A covariance as sigmas and the Cholesky factor of its correlations: remains positive definite
/// when rounded.
struct CovarianceCode {
  std::array<unsigned, 6> sigmas{};
  std::array<std::int64_t, 15> factor{};  ///< rows 1..5 left of the diagonal
};

/// Empty when `covariance` is not finite and positive definite.
[[nodiscard]] std::optional<CovarianceCode> encode_covariance(const Matrix6d& covariance);
/// Empty when the diagonal of a row would not be positive.
[[nodiscard]] std::optional<Matrix6d> decode_covariance(const CovarianceCode& code);

}  // namespace crepes
