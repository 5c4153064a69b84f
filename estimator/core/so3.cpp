#include "estimator/core/so3.hpp"

#include <algorithm>
#include <cmath>

namespace crepes {
namespace {

// Below this angle the series to fourth order is exact to double precision.
constexpr double kSmallAngle = 1e-3;

}  // namespace

Eigen::Matrix3d hat(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

Eigen::Quaterniond so3_exp(const Eigen::Vector3d& theta) {
  const double angle2 = theta.squaredNorm();
  const double angle = std::sqrt(angle2);
  const double half_sinc =
      angle < kSmallAngle ? 0.5 - angle2 / 48.0 : std::sin(0.5 * angle) / angle;
  const double w = std::cos(0.5 * angle);
  const Eigen::Vector3d v = half_sinc * theta;
  return {w, v.x(), v.y(), v.z()};
}

Eigen::Vector3d so3_log(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;  // q and -q are one rotation: use the short way
  const Eigen::Vector3d v = sign * q.vec();
  const double sine = v.norm();
  const double cosine = sign * q.w();
  if (sine < kSmallAngle) {
    // angle / sin(angle/2) = 2 (1 + s^2/6 + ...) with s = sin(angle/2)
    return (2.0 + sine * sine / 3.0) * v;
  }
  return 2.0 * std::atan2(sine, cosine) / sine * v;
}

Eigen::Matrix3d so3_right_jacobian(const Eigen::Vector3d& theta) {
  const double angle2 = theta.squaredNorm();
  const double angle = std::sqrt(angle2);
  const Eigen::Matrix3d W = hat(theta);
  // J_r = I - (1 - cos a)/a^2 W + (a - sin a)/a^3 W^2
  const bool small = angle < kSmallAngle;
  const double a = small ? 0.5 - angle2 / 24.0 : (1.0 - std::cos(angle)) / angle2;
  const double b =
      small ? 1.0 / 6.0 - angle2 / 120.0 : (angle - std::sin(angle)) / (angle2 * angle);
  return Eigen::Matrix3d::Identity() - a * W + b * W * W;
}

Eigen::Matrix3d so3_right_jacobian_inverse(const Eigen::Vector3d& theta) {
  const double angle2 = theta.squaredNorm();
  const double angle = std::sqrt(angle2);
  const Eigen::Matrix3d W = hat(theta);
  // J_r^-1 = I + W/2 + (1/a^2 - (1 + cos a)/(2 a sin a)) W^2, the last factor written with the
  // half angle so that it stays finite at pi.
  const double half = 0.5 * angle;
  const double c = angle < kSmallAngle ? 1.0 / 12.0 + angle2 / 720.0
                                       : (1.0 - half * std::cos(half) / std::sin(half)) / angle2;
  return Eigen::Matrix3d::Identity() + 0.5 * W + c * W * W;
}

// Eigen's FromTwoVectors compiles a singular value decomposition for the half turn.
Eigen::Quaterniond shortest_rotation(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  constexpr double kHalfTurn = -1.0 + 1e-12;  // cosine
  const Eigen::Vector3d a = from.normalized();
  const Eigen::Vector3d b = to.normalized();
  const double cosine = b.dot(a);
  Eigen::Quaterniond q;
  if (cosine < kHalfTurn) {
    q.w() = 0.0;
    q.vec() = tangent_basis(a).col(0);
    return q;
  }
  const double s = std::sqrt((1.0 + cosine) * 2.0);
  q.vec() = a.cross(b) * (1.0 / s);
  q.w() = s * 0.5;
  return q;
}

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

Eigen::Vector3d roll_pitch_yaw_of(const Eigen::Quaterniond& q) {
  const Eigen::Matrix3d R = q.toRotationMatrix();
  return {std::atan2(R(2, 1), R(2, 2)), std::asin(std::clamp(-R(2, 0), -1.0, 1.0)),
          std::atan2(R(1, 0), R(0, 0))};
}

Eigen::Matrix<double, 3, 2> tangent_basis(const Eigen::Vector3d& u) {
  const double sign = std::copysign(1.0, u.z());
  const double a = -1.0 / (sign + u.z());
  const double b = u.x() * u.y() * a;
  Eigen::Matrix<double, 3, 2> basis;
  basis << 1.0 + sign * u.x() * u.x() * a, b,  //
      sign * b, sign + u.y() * u.y() * a,      //
      -sign * u.x(), -u.y();
  return basis;
}

Eigen::Vector2d angles_across(const Eigen::Vector3d& predicted,
                              const Eigen::Matrix<double, 3, 2>& across, const Eigen::Vector3d& u) {
  const double sine = predicted.cross(u).norm();
  const double stretch = sine < 1e-9 ? 1.0 : std::atan2(sine, predicted.dot(u)) / sine;
  return stretch * (across.transpose() * u);
}

}  // namespace crepes
