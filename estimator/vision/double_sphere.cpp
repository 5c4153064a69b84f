#include "estimator/vision/double_sphere.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Where the image turns back on itself, a pixel sees ever more of the world. With less radius than
// this for a radian, as a part of the radius, ten digits of a direction are lost.
constexpr double kMinSlope = 1e-4;
constexpr double kRoundOff = 1e-12;

/// alpha d2 + (1 - alpha) c with d2^2 = rho^2 + c^2, also where the two terms cancel.
double denominator_of(double alpha, double rho2, double c, double d2) {
  if (c >= 0.0) return alpha * d2 + (1.0 - alpha) * c;
  return (alpha * alpha * rho2 + (2.0 * alpha - 1.0) * c * c) / (alpha * d2 - (1.0 - alpha) * c);
}

/// r(theta) = sin / D,  D = alpha d2 + (1 - alpha) c,  c = xi + cos,  d2^2 = 1 + 2 xi cos + xi^2:
/// equations 40 to 42 on the unit sphere, and the derivative by the angle theta, by which D
/// shrinks.
struct Radius {
  double value;
  double slope;
};
Radius radius_at(double xi, double alpha, double theta) {
  const double sine = std::sin(theta);
  const double cosine = std::cos(theta);
  const double d2 = std::sqrt(1.0 + 2.0 * xi * cosine + xi * xi);
  const double D = denominator_of(alpha, sine * sine, xi + cosine, d2);
  const double shrinkage = sine * (alpha * xi / d2 + 1.0 - alpha);
  return {sine / D, (cosine * D + sine * shrinkage) / (D * D)};
}

}  // namespace

DoubleSphere::DoubleSphere(double xi, double alpha)
    : xi_(xi),
      alpha_(alpha),
      w1_(alpha <= 0.5 ? alpha / (1.0 - alpha) : (1.0 - alpha) / alpha),
      max_radius2_(kInfinity) {
  CREPES_EXPECT(xi > -1.0 && xi < 1.0 && alpha >= 0.0 && alpha <= 1.0, "Double Sphere's domain");
  if (alpha <= 0.5) return;

  // Above one half the image ends in a circle (eq. 51) at which it would turn back.
  double inside = 0.0;
  double outside = std::numbers::pi;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (inside + outside);
    const Radius r = radius_at(xi, alpha, middle);
    (r.slope > kMinSlope * (1.0 + r.value) ? inside : outside) = middle;
  }
  max_radius2_ = std::pow(radius_at(xi, alpha, inside).value, 2);
}

// Equations 40 to 45:  d1 = |p|,  c = xi d1 + z,  d2 = sqrt(x^2 + y^2 + c^2),
// m = (x, y) / (alpha d2 + (1 - alpha) c). The denominator vanishes (alpha <= 1/2) or the image
// turns back (alpha > 1/2) where the second sphere is seen at the cosine c / d2 = -w1. Equation 43
// says so of z / d1, but is only near to it: by 1 degree for common lenses, on either side.
std::optional<Eigen::Vector2d> DoubleSphere::project(const Eigen::Vector3d& p_C,
                                                     Eigen::Matrix<double, 2, 3>* J) const {
  const double d1 = p_C.norm();
  if (!std::isfinite(d1) || d1 == 0.0) return std::nullopt;
  const double c = xi_ * d1 + p_C.z();
  const double rho2 = p_C.head<2>().squaredNorm();
  const double d2 = std::sqrt(rho2 + c * c);
  const double denominator = denominator_of(alpha_, rho2, c, d2);
  if (!(c > -w1_ * d2 && denominator > kRoundOff * d1)) return std::nullopt;

  const Eigen::Vector2d m = p_C.head<2>() / denominator;
  if (!(m.squaredNorm() <= max_radius2_)) return std::nullopt;
  if (J != nullptr) {
    const Eigen::RowVector3d d_c = xi_ / d1 * p_C.transpose() + Eigen::RowVector3d::UnitZ();
    const Eigen::RowVector3d d_d2 = (Eigen::RowVector3d(p_C.x(), p_C.y(), 0.0) + c * d_c) / d2;
    const Eigen::RowVector3d d_denominator = alpha_ * d_d2 + (1.0 - alpha_) * d_c;
    *J = (Eigen::Matrix<double, 2, 3>::Identity() - m * d_denominator) / denominator;
  }
  return m;
}

// Equations 46 to 51:  m_z = (1 - alpha^2 r^2) / (alpha s + 1 - alpha),
// s = sqrt(1 - (2 alpha - 1) r^2),  k = (m_z xi + sqrt(m_z^2 + (1 - xi^2) r^2)) / (m_z^2 + r^2),
// u = k m - (0, 0, xi).
std::optional<Eigen::Vector3d> DoubleSphere::unproject(const Eigen::Vector2d& m_xy,
                                                       Eigen::Matrix<double, 3, 2>* J) const {
  const double r2 = m_xy.squaredNorm();
  if (!std::isfinite(r2) || !(r2 <= max_radius2_ * (1.0 + kRoundOff))) return std::nullopt;
  const double s = std::sqrt(1.0 - (2.0 * alpha_ - 1.0) * r2);
  const double denominator = alpha_ * s + 1.0 - alpha_;
  const double m_z = (1.0 - alpha_ * alpha_ * r2) / denominator;
  const double norm2 = m_z * m_z + r2;
  const double root = std::sqrt(m_z * m_z + (1.0 - xi_ * xi_) * r2);
  const double k = (m_z * xi_ + root) / norm2;

  if (J != nullptr) {
    const double d_mz =
        (alpha_ * (2.0 * alpha_ - 1.0) * m_z / (2.0 * s) - alpha_ * alpha_) / denominator;
    const double d_root = (2.0 * m_z * d_mz + 1.0 - xi_ * xi_) / (2.0 * root);
    const double d_k = (xi_ * d_mz + d_root - k * (2.0 * m_z * d_mz + 1.0)) / norm2;
    const Eigen::Vector3d m(m_xy.x(), m_xy.y(), m_z);
    const Eigen::Vector3d d_m = d_k * m + Eigen::Vector3d(0.0, 0.0, k * d_mz);
    *J = k * Eigen::Matrix<double, 3, 2>::Identity() + d_m * 2.0 * m_xy.transpose();
  }
  return Eigen::Vector3d(k * m_xy.x(), k * m_xy.y(), k * m_z - xi_);
}

}  // namespace crepes
