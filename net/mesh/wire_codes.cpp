#include "net/mesh/wire_codes.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace crepes {
namespace {

constexpr auto kUnit = static_cast<double>(kDirectionUnit);
constexpr auto kFactor = static_cast<double>(kFactorUnit);
constexpr LogScale kSigmas{1e-5, 1e3, 4095};

std::int64_t to_code(double v) { return static_cast<std::int64_t>(std::clamp(v, -kUnit, kUnit)); }

double sign_of(double x) { return std::signbit(x) ? -1.0 : 1.0; }

}  // namespace

std::array<std::int64_t, 2> encode_direction(const Eigen::Vector3d& u) {
  const Eigen::Vector3d n = u / u.lpNorm<1>();
  double a = n.x();
  double b = n.y();
  if (n.z() < 0) {  // fold the lower half over the edges
    a = (1 - std::abs(n.y())) * sign_of(n.x());
    b = (1 - std::abs(n.x())) * sign_of(n.y());
  }
  // Of the four surrounding codes, the nearest on the sphere, which may differ from the nearest in
  // the plane.
  std::array<std::int64_t, 2> best{};
  double least = std::numeric_limits<double>::infinity();
  for (const double column : {std::floor(a * kUnit), std::ceil(a * kUnit)}) {
    for (const double row : {std::floor(b * kUnit), std::ceil(b * kUnit)}) {
      const std::array code{to_code(column), to_code(row)};
      const double error = (decode_direction(code) - u).squaredNorm();
      if (error < least) {
        least = error;
        best = code;
      }
    }
  }
  return best;
}

Eigen::Vector3d decode_direction(const std::array<std::int64_t, 2>& code) {
  const double a = static_cast<double>(code[0]) / kUnit;
  const double b = static_cast<double>(code[1]) / kUnit;
  Eigen::Vector3d n{a, b, 1 - std::abs(a) - std::abs(b)};
  if (n.z() < 0) {
    n.x() = (1 - std::abs(b)) * sign_of(a);
    n.y() = (1 - std::abs(a)) * sign_of(b);
  }
  return n.normalized();
}

unsigned LogScale::encode(double value) const {
  const double part = std::log(value / min) / std::log(max / min);
  return static_cast<unsigned>(std::lround(std::clamp(part, 0.0, 1.0) * steps));
}

double LogScale::decode(unsigned code) const {
  return min * std::pow(max / min, code / static_cast<double>(steps));
}

std::optional<CovarianceCode> encode_covariance(const Matrix6d& covariance) {
  if (!covariance.allFinite() || covariance.diagonal().minCoeff() <= 0) return std::nullopt;
  const Vector6d sigmas = covariance.diagonal().cwiseSqrt();
  const Matrix6d correlations =
      sigmas.cwiseInverse().asDiagonal() * covariance * sigmas.cwiseInverse().asDiagonal();
  const Eigen::LLT<Matrix6d> cholesky(correlations);
  if (cholesky.info() != Eigen::Success) return std::nullopt;

  const Matrix6d L = cholesky.matrixL();
  CovarianceCode code;
  std::size_t next = 0;
  for (int row = 0; row < 6; ++row) {
    code.sigmas.at(static_cast<std::size_t>(row)) = kSigmas.encode(sigmas[row]);
    // Rounds towards zero, so that the norm of the row stays below 1.
    for (int column = 0; column < row; ++column)
      code.factor.at(next++) = static_cast<std::int64_t>(L(row, column) * kFactor);
  }
  return decode_covariance(code) ? std::optional(code) : std::nullopt;
}

std::optional<Matrix6d> decode_covariance(const CovarianceCode& code) {
  constexpr double kLeast = 1e-9;  // the least share of a row's variance on the diagonal
  Matrix6d L = Matrix6d::Zero();
  std::size_t next = 0;
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < row; ++column)
      L(row, column) = static_cast<double>(code.factor.at(next++)) / kFactor;
    const double own = 1 - L.row(row).squaredNorm();
    if (own < kLeast) return std::nullopt;
    L(row, row) = std::sqrt(own);
    L.row(row) *= kSigmas.decode(code.sigmas.at(static_cast<std::size_t>(row)));
  }
  return L * L.transpose();
}

}  // namespace crepes
