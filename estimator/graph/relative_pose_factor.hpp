/// Cost terms of the pose graph, for automatic differentiation.
///
/// A robot's pose in self's frame is seven numbers: position, then quaternion x y z w.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "estimator/core/pose.hpp"

namespace crepes {

inline constexpr int kPoseParameters = 7;

/// Log of a unit quaternion, for any scalar; smooth through the identity.
template <class T>
Eigen::Matrix<T, 3, 1> quaternion_log(const Eigen::Quaternion<T>& q) {
  using std::atan2;
  using std::sqrt;
  const T sign = q.w() < T(0) ? T(-1) : T(1);
  const Eigen::Matrix<T, 3, 1> v = sign * q.vec();
  const T sine2 = v.squaredNorm();
  if (sine2 < T(1e-12)) return T(2) * v;
  const T sine = sqrt(sine2);
  return (T(2) * atan2(sine, sign * q.w()) / sine) * v;
}

/// Weighted by covariance, in GaussianPose's error convention:
///   r = L [ p(X_i^-1 X_j) - p_ij ;  Log(R_ij^T R_i^T R_j) ],   L^T L = covariance^-1.
struct LieFactor {
  Pose T_i_j;
  Matrix6d L;

  template <class T>
  bool operator()(const T* X_i, const T* X_j, T* residual) const {
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    const Eigen::Map<const Vector3> p_i(X_i);
    const Eigen::Map<const Vector3> p_j(X_j);
    const Eigen::Map<const Eigen::Quaternion<T>> q_i(X_i + 3);
    const Eigen::Map<const Eigen::Quaternion<T>> q_j(X_j + 3);
    const Eigen::Quaternion<T> q_i_inv = q_i.conjugate();
    Eigen::Matrix<T, 6, 1> error;
    error.template head<3>() = q_i_inv * Vector3(p_j - p_i) - T_i_j.p.cast<T>();
    error.template tail<3>() = quaternion_log<T>(T_i_j.q.conjugate().cast<T>() * (q_i_inv * q_j));
    Eigen::Map<Eigen::Matrix<T, 6, 1>> out(residual);
    out = L.cast<T>() * error;
    return true;
  }
};

/// The paper's cost (eq. 22): the entries of  T_ij X_j^-1 X_i - I,  whose squared norm is r_ij.
struct FrobeniusFactor {
  Pose T_i_j;

  template <class T>
  bool operator()(const T* X_i, const T* X_j, T* residual) const {
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    using Matrix3 = Eigen::Matrix<T, 3, 3>;
    const Eigen::Map<const Vector3> p_i(X_i);
    const Eigen::Map<const Vector3> p_j(X_j);
    const Eigen::Map<const Eigen::Quaternion<T>> q_i(X_i + 3);
    const Eigen::Map<const Eigen::Quaternion<T>> q_j(X_j + 3);
    const Eigen::Quaternion<T> q_i_j = T_i_j.q.cast<T>();
    const Eigen::Quaternion<T> q_j_inv = q_j.conjugate();
    Eigen::Map<Matrix3> rotation(residual);
    Eigen::Map<Vector3> translation(residual + 9);
    rotation = (q_i_j * q_j_inv * q_i).toRotationMatrix() - Matrix3::Identity();
    translation = q_i_j * (q_j_inv * Vector3(p_i - p_j)) + T_i_j.p.cast<T>();
    return true;
  }
};

/// Moves a pose by GaussianPose's error: position added, rotation multiplied on the right.
struct RightPerturbation {
  template <class T>
  bool Plus(const T* x, const T* delta,
            T* x_plus) const {  // NOLINT(readability-identifier-naming): Ceres' name
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    Eigen::Map<Vector3>{x_plus} = Eigen::Map<const Vector3>(x) + Eigen::Map<const Vector3>(delta);
    const Eigen::Map<const Vector3> theta(delta + 3);
    using std::cos;
    using std::sin;
    using std::sqrt;
    const T angle2 = theta.squaredNorm();
    Eigen::Quaternion<T> dq;
    if (angle2 > T(1e-12)) {
      const T angle = sqrt(angle2);
      dq.w() = cos(T(0.5) * angle);
      dq.vec() = (sin(T(0.5) * angle) / angle) * theta;
    } else {
      dq.w() = T(1);
      dq.vec() = T(0.5) * theta;
    }
    Eigen::Map<Eigen::Quaternion<T>>(x_plus + 3) =
        (Eigen::Map<const Eigen::Quaternion<T>>(x + 3) * dq).normalized();
    return true;
  }

  template <class T>
  bool Minus(const T* y, const T* x,
             T* y_minus_x) const {  // NOLINT(readability-identifier-naming): Ceres' name
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    Eigen::Map<Vector3>{y_minus_x} = Eigen::Map<const Vector3>(y) - Eigen::Map<const Vector3>(x);
    Eigen::Map<Vector3>(y_minus_x + 3) =
        quaternion_log<T>(Eigen::Map<const Eigen::Quaternion<T>>(x + 3).conjugate() *
                          Eigen::Map<const Eigen::Quaternion<T>>(y + 3));
    return true;
  }
};

}  // namespace crepes
