/// A robot's own roll and pitch from gyroscope and accelerometer.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

#include "estimator/core/config.hpp"
#include "estimator/core/measurements.hpp"

namespace crepes {

/// Error-state filter on attitude and gyro bias. An accelerometer alone shows gravity only on a
/// robot that stands still: what flies is accelerated along its own z axis whatever its tilt. So
/// the force counts as gravity plus an unknown acceleration, correlated over a second and as large
/// as the present motion suggests, and the gyroscope carries the attitude in between.
class TiltFilter {
 public:
  explicit TiltFilter(ImuConfig config);

  /// Another noise from now on; what is known stays known.
  void set_noise(const ImuConfig& config) { config_ = config; }

  /// False, and nothing changes: not plausible, or a stamp that does not advance. A gap of more
  /// than half a second starts the filter anew.
  bool add(const ImuSample& sample);

  /// Empty until enough samples came to average out the first ones.
  [[nodiscard]] std::optional<Tilt> tilt() const;

 private:
  void start(const ImuSample& sample);
  void predict(const ImuSample& sample, double dt);
  void correct(const ImuSample& sample, double dt);

  ImuConfig config_;
  std::optional<ImuSample> last_;
  int samples_ = 0;
  Eigen::Quaterniond q_L_B_ = Eigen::Quaterniond::Identity();  // heading arbitrary
  Eigen::Vector3d gyro_bias_ = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 6, 6> P_ = Eigen::Matrix<double, 6, 6>::Zero();  // [theta (B), gyro bias]
  double turning_radps_ = 0.0;                                           // smoothed |w|
  double surplus_mps2_ = 0.0;                                            // smoothed ||a| - g|
};

}  // namespace crepes
