/// The direction of one light over successive frames.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace crepes {

/// A Kalman filter of the direction in the body frame. Beside own rotation, which the gyro
/// measures, the light moves at a constant rate with white acceleration. The covariance is that of
/// each of the two axes across the direction.
struct LightDirection {
  Eigen::Vector3d u_B = Eigen::Vector3d::UnitX();
  Eigen::Vector3d rate_B = Eigen::Vector3d::Zero();  ///< du/dt that own rotation leaves [1/s]
  double variance = 0.0;                             ///< of the direction, per axis [rad^2]
  double covariance = 0.0;                           ///< of direction and rate [rad^2/s]
  double rate_variance = 0.0;                        ///< [rad^2/s^2]
  double scatter_px2 = 0.0;  ///< of the centers of its spots, variance per axis

  /// Of a light in its first frame, in which a pixel subtends `px_rad`.
  [[nodiscard]] static LightDirection at(const Eigen::Vector3d& u_B, double px_rad,
                                         double sigma_px);

  /// To the next frame after `dt_s`, in which the body axes have turned.
  void predict(const Eigen::Quaterniond& R_now_before, double dt_s);
  /// By a spot whose center has at least the sigma `least_px`; `hits` spots came before. Measures
  /// the scatter of the spots about the predicted directions.
  void correct(const Eigen::Vector3d& spot_B, double px_rad, double least_px, int hits);

  /// Sigma of the spots' centers. A dim spot scatters more than a bright one.
  [[nodiscard]] double sigma_px(double least_px) const;
};

}  // namespace crepes
