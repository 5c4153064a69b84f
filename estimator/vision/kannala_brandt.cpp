#include "estimator/vision/kannala_brandt.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace crepes {
namespace {

// Where r ceases to grow, a pixel sees ever more of the world. Below this slope ten digits of a
// direction are lost.
constexpr double kMinRadiusSlope = 1e-3;
constexpr double kAngleRoundOff = 1e-12;
constexpr int kMaxIterations = 100;

/// c0 + c1 x + c2 x^2 + ...
double polynomial(const std::vector<double>& c, double x) {
  double value = 0.0;
  for (std::size_t i = c.size(); i-- > 0;) value = value * x + c[i];
  return value;
}

/// Where a polynomial changes its sign in [0, end], in ascending order: once at most between two
/// neighboring extrema, which are where its derivative changes its sign.
std::vector<double> sign_changes(const std::vector<double>& c, double end) {
  if (c.size() < 2) return {};
  std::vector<double> derivative;
  for (std::size_t i = 1; i < c.size(); ++i) derivative.push_back(static_cast<double>(i) * c[i]);
  std::vector<double> borders = sign_changes(derivative, end);
  borders.push_back(end);

  std::vector<double> found;
  double begin = 0.0;
  for (const double border : borders) {
    const bool is_negative = polynomial(c, begin) < 0.0;
    if (is_negative != (polynomial(c, border) < 0.0)) {
      double low = begin;
      double high = border;
      for (int i = 0; i < kMaxIterations; ++i) {
        const double middle = 0.5 * (low + high);
        ((polynomial(c, middle) < 0.0) == is_negative ? low : high) = middle;
      }
      found.push_back(low);
    }
    begin = border;
  }
  return found;
}

}  // namespace

KannalaBrandt::KannalaBrandt(const std::array<double, 4>& k) : k_(k) {
  // r'(t) is a polynomial in t^2.
  const std::vector<double> excess{1.0 - kMinRadiusSlope, 3.0 * k[0], 5.0 * k[1], 7.0 * k[2],
                                   9.0 * k[3]};
  const std::vector<double> turns = sign_changes(excess, std::numbers::pi * std::numbers::pi);
  max_angle_rad_ = turns.empty() ? std::numbers::pi : std::sqrt(turns.front());
  max_radius_ = radius(max_angle_rad_);
}

double KannalaBrandt::radius(double angle) const {
  const double t2 = angle * angle;
  return angle * (1.0 + t2 * (k_[0] + t2 * (k_[1] + t2 * (k_[2] + t2 * k_[3]))));
}

double KannalaBrandt::slope(double angle) const {
  const double t2 = angle * angle;
  return 1.0 + t2 * (3.0 * k_[0] + t2 * (5.0 * k_[1] + t2 * (7.0 * k_[2] + t2 * 9.0 * k_[3])));
}

/// Newton's method within a bracket that every step narrows. It is halved where a step would leave
/// it, or is not half of the step before: between two ends that lead to each other Newton's steps
/// hardly narrow it.
double KannalaBrandt::angle(double radius_wanted) const {
  double low = 0.0;
  double high = max_angle_rad_;
  double t = std::min(radius_wanted, max_angle_rad_);
  double step = high;
  for (int i = 0; i < kMaxIterations; ++i) {
    const double excess = radius(t) - radius_wanted;
    (excess > 0.0 ? high : low) = t;
    double next = t - excess / slope(t);
    if (!(next > low && next < high && std::abs(next - t) <= 0.5 * step)) next = 0.5 * (low + high);
    step = std::abs(next - t);
    if (step <= std::numeric_limits<double>::epsilon() * t) return next;
    t = next;
  }
  return t;
}

std::optional<Eigen::Vector2d> KannalaBrandt::project(const Eigen::Vector3d& p_C,
                                                      Eigen::Matrix<double, 2, 3>* J) const {
  const double norm2 = p_C.squaredNorm();
  if (!std::isfinite(norm2) || norm2 == 0.0) return std::nullopt;
  const double rho = p_C.head<2>().norm();
  const double t = std::atan2(rho, p_C.z());
  if (!(t < std::min(max_angle_rad_ + kAngleRoundOff, std::numbers::pi))) return std::nullopt;
  if (rho == 0.0) {
    if (J != nullptr) *J = Eigen::Matrix<double, 2, 3>::Identity() / p_C.z();
    return Eigen::Vector2d::Zero();
  }
  // m = r(t) e,  t = atan2(rho, z),  e = (x, y) / rho.
  const double r = radius(t);
  const Eigen::Vector2d e = p_C.head<2>() / rho;
  if (J != nullptr) {
    const Eigen::Matrix2d along = e * e.transpose();
    J->leftCols<2>() =
        slope(t) * p_C.z() / norm2 * along + r / rho * (Eigen::Matrix2d::Identity() - along);
    J->col(2) = -slope(t) * rho / norm2 * e;
  }
  return r * e;
}

std::optional<Eigen::Vector3d> KannalaBrandt::unproject(const Eigen::Vector2d& m,
                                                        Eigen::Matrix<double, 3, 2>* J) const {
  const double r = m.norm();
  if (!std::isfinite(r) || !(r <= max_radius_ * (1.0 + kAngleRoundOff))) return std::nullopt;
  if (r == 0.0) {
    if (J != nullptr) *J = Eigen::Matrix<double, 3, 2>::Identity();
    return Eigen::Vector3d::UnitZ();
  }
  // u = (sin t e, cos t),  e = m / r.
  const double t = angle(r);
  const Eigen::Vector2d e = m / r;
  if (J != nullptr) {
    const Eigen::Matrix2d along = e * e.transpose();
    const double dt = 1.0 / slope(t);
    J->topRows<2>() =
        std::cos(t) * dt * along + std::sin(t) / r * (Eigen::Matrix2d::Identity() - along);
    J->row(2) = -std::sin(t) * dt * e.transpose();
  }
  return Eigen::Vector3d(std::sin(t) * e.x(), std::sin(t) * e.y(), std::cos(t));
}

}  // namespace crepes
