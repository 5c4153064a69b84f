/// The Double Sphere lens: directions to the normalized image and back.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace crepes {

/// Usenko, Demmel, Cremers 2018, "The Double Sphere Camera Model", section III-D, without focal
/// lengths and center: m = (u - c) / f. Empty where the image would turn back on itself, and so
/// near to it that ten digits of a direction would be lost.
class DoubleSphere {
 public:
  /// -1 < `xi` < 1, 0 <= `alpha` <= 1.
  DoubleSphere(double xi, double alpha);

  /// J: d m / d p_C.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p_C,
                                                       Eigen::Matrix<double, 2, 3>* J) const;
  /// The unit direction. J: d u_C / d m.
  [[nodiscard]] std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& m_xy,
                                                         Eigen::Matrix<double, 3, 2>* J) const;

 private:
  double xi_;
  double alpha_;
  double w1_;           ///< eq. 44: the second sphere ends at the cosine -w1
  double max_radius2_;  ///< greatest |m|^2 that unprojects
};

}  // namespace crepes
