/// The Kannala-Brandt lens: directions to the normalized image and back.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

namespace crepes {

/// Kannala and Brandt 2006, "A Generic Camera Model and Calibration Method", as in Kalibr (pinhole
/// with equidistant distortion) and OpenCV (fisheye), without focal lengths and center: a direction
/// at the angle t to the optical axis is seen at the radius
///   r(t) = t + k1 t^3 + k2 t^5 + k3 t^7 + k4 t^9.
/// Valid as far as r grows with t, and up to t = pi.
class KannalaBrandt {
 public:
  /// Finite coefficients k1 to k4.
  explicit KannalaBrandt(const std::array<double, 4>& k);

  /// The angle to the optical axis at which r ceases to grow [rad], at most pi.
  [[nodiscard]] double max_angle_rad() const { return max_angle_rad_; }

  /// J: d m / d p_C.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p_C,
                                                       Eigen::Matrix<double, 2, 3>* J) const;
  /// The unit direction. J: d u_C / d m.
  [[nodiscard]] std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& m,
                                                         Eigen::Matrix<double, 3, 2>* J) const;

 private:
  [[nodiscard]] double radius(double angle) const;
  [[nodiscard]] double slope(double angle) const;
  [[nodiscard]] double angle(double radius) const;

  std::array<double, 4> k_;
  double max_angle_rad_;
  double max_radius_;
};

}  // namespace crepes
