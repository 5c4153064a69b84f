/// Compact codes of the values in a peer message. Pure functions.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "estimator/core/pose.hpp"

namespace crepes {

/// The octahedral map of a unit vector (Cigolle et al. 2014, "A survey of efficient representations
/// for independent unit vectors").
[[nodiscard]] std::array<std::int16_t, 2> encode_direction(const Eigen::Vector3d& u);
/// Empty for the value -32768, which the encoder never writes.
[[nodiscard]] std::optional<Eigen::Vector3d> decode_direction(
    const std::array<std::int16_t, 2>& code);

/// Positive numbers from `min` to `max`, quantized to `steps` + 1 levels of equal ratio; numbers
/// outside are clamped.
struct LogScale {
  double min;
  double max;
  unsigned steps;

  [[nodiscard]] unsigned encode(double value) const;
  [[nodiscard]] double decode(unsigned code) const;
};

/// A covariance as sigmas and the Cholesky factor of its correlations: remains positive definite
/// when rounded.
struct CovarianceCode {
  std::array<std::uint16_t, 6> sigmas{};
  std::array<std::int16_t, 15> factor{};  ///< rows 1..5 left of the diagonal
};

/// Empty when `covariance` is not finite and positive definite.
[[nodiscard]] std::optional<CovarianceCode> encode_covariance(const Matrix6d& covariance);
/// Empty when the diagonal of a row would not be positive.
[[nodiscard]] std::optional<Matrix6d> decode_covariance(const CovarianceCode& code);

}  // namespace crepes
