/// Rotations, lens and inertial steps for numbers that carry their derivatives.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <optional>
#include <type_traits>

namespace crepes {

template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;
template <class T>
using Matrix3 = Eigen::Matrix<T, 3, 3>;

/// `x` as the parameter with this index; a plain number is none.
template <class T>
T seeded(double x, int index) {
  if constexpr (std::is_same_v<T, double>) {
    static_cast<void>(index);
    return x;
  } else {
    return T(x, index);
  }
}

template <class T>
Vector3<T> seeded(const Eigen::Vector3d& x, int index) {
  return {seeded<T>(x.x(), index), seeded<T>(x.y(), index + 1), seeded<T>(x.z(), index + 2)};
}

/// R Exp(d) at d = 0.
template <class T>
Matrix3<T> seeded_rotation(const Eigen::Quaterniond& q, int index) {
  Matrix3<T> R = q.toRotationMatrix().cast<T>();
  if constexpr (std::is_same_v<T, double>) return R;
  const Vector3<T> d = seeded<T>(Eigen::Vector3d::Zero(), index);
  Matrix3<T> turn;
  turn << T(1.0), -d.z(), d.y(), d.z(), T(1.0), -d.x(), -d.y(), d.x(), T(1.0);
  return R * turn;
}

/// Exp(phi) x by the series of Rodrigues' formula: exact to 1e-9 up to 0.5 rad, smooth at zero.
template <class T>
[[nodiscard]] Vector3<T> rotated(const Vector3<T>& phi, const Vector3<T>& x) {
  const T a2 = phi.squaredNorm();
  const T sine = T(1.0) - a2 * (1.0 / 6.0) * (T(1.0) - a2 * (1.0 / 20.0) * (T(1.0) - a2 / 42.0));
  const T cosine = T(0.5) - a2 * (1.0 / 24.0) * (T(1.0) - a2 * (1.0 / 30.0) * (T(1.0) - a2 / 56.0));
  const Vector3<T> once = phi.cross(x);
  const Vector3<T> twice = phi.cross(once);
  return x + once * sine + twice * cosine;
}

/// Log of a rotation matrix of less than a right angle: exact to 1e-3 of itself up to 0.5 rad.
template <class T>
[[nodiscard]] Vector3<T> small_log(const Matrix3<T>& R) {
  const Vector3<T> r(0.5 * (R(2, 1) - R(1, 2)), 0.5 * (R(0, 2) - R(2, 0)),
                     0.5 * (R(1, 0) - R(0, 1)));
  const T s2 = r.squaredNorm();  // asin(s) / s
  return r * (T(1.0) + s2 * (1.0 / 6.0) * (T(1.0) + s2 * (9.0 / 20.0)));
}

/// Double Sphere (Usenko, Demmel, Cremers 2018, eq. 40 to 45): `lens` is xi, alpha, fx, fy, cx, cy.
/// Empty where the lens has no projection.
template <class T>
[[nodiscard]] std::optional<Eigen::Matrix<T, 2, 1>> project_double_sphere(
    const Eigen::Matrix<T, 6, 1>& lens, const Vector3<T>& p_C) {
  using std::sqrt;
  const T& xi = lens[0];
  const T& alpha = lens[1];
  const T rho2 = p_C.x() * p_C.x() + p_C.y() * p_C.y();
  const T d1 = sqrt(rho2 + p_C.z() * p_C.z());
  const T c = xi * d1 + p_C.z();
  const T d2 = sqrt(rho2 + c * c);
  const T w1 = alpha > T(0.5) ? (T(1.0) - alpha) / alpha : alpha / (T(1.0) - alpha);
  const T denominator = alpha * d2 + (T(1.0) - alpha) * c;
  if (!(c > -w1 * d2) || !(denominator > T(1e-6) * d1)) return std::nullopt;
  return Eigen::Matrix<T, 2, 1>(lens[2] * p_C.x() / denominator + lens[4],
                                lens[3] * p_C.y() / denominator + lens[5]);
}

/// The body's motion at one instant.
template <class T>
struct Motion {
  Matrix3<T> R_W_B;
  Vector3<T> v_W;
  Vector3<T> p_W;
};

/// One IMU sample, calibrated: mean rate and specific force of an interval of `dt`, and how the
/// rate changes within it.
template <class T>
struct InertialStep {
  Vector3<T> rate;
  Vector3<T> rate_change;  ///< [rad/s^2]
  Vector3<T> accel;
  double dt = 0.0;

  /// The rotation vector after `tau` of the interval, with the second term of Magnus' series:
  ///   w tau + s tau (tau - dt) / 2 + (w x s) tau^3 / 12 .
  [[nodiscard]] Vector3<T> angle(const T& tau) const {
    return rate * tau + rate_change * (0.5 * tau * (tau - T(dt))) +
           rate.cross(rate_change) * (tau * tau * tau * (1.0 / 12.0));
  }

  /// The mean acceleration in the world, gravity taken off.
  [[nodiscard]] Vector3<T> world_acceleration(const Matrix3<T>& R_W_B, double gravity) const {
    const Vector3<T> phi = rate * T(dt);
    const Vector3<T> once = phi.cross(accel);
    Vector3<T> a = R_W_B * (accel + once * T(0.5) + phi.cross(once) * T(1.0 / 6.0));
    a.z() -= T(gravity);
    return a;
  }
};

}  // namespace crepes
