/// A robot's own roll and pitch from gyroscope and accelerometer.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

#include "estimator/core/measurements.hpp"
#include "estimator/core/sensor_noise.hpp"

namespace crepes {

/// Error-state filter on attitude and gyro bias. An accelerometer measures gravity only on a robot
/// at rest: thrust acts along the z axis of the body, whatever its tilt. So the model of the force
/// is gravity plus an unknown acceleration. The acceleration is correlated over a second, and its
/// size follows from the present motion. The gyroscope propagates the attitude.
class TiltFilter {
 public:
  explicit TiltFilter(const ImuNoise& config);

  /// Changes the noise and keeps the state.
  void set_noise(const ImuNoise& config) { config_ = config; }

  /// False, and nothing changes, if the sample is implausible or its stamp does not advance. A gap
  /// of more than half a second restarts the filter.
  bool add(const ImuSample& sample);

  /// Forgets what it knows: the gyroscope was false.
  void restart() {
    last_.reset();
    samples_ = 0;
  }

  /// Empty for the first samples after a start.
  [[nodiscard]] std::optional<Tilt> tilt() const;

 private:
  void start(const ImuSample& sample);
  void predict(const ImuSample& sample, double dt);
  void correct(const ImuSample& sample, double dt);
  /// What the present motion lets one expect, one sigma [m/s^2].
  [[nodiscard]] double acceleration() const;

  ImuNoise config_;
  std::optional<ImuSample> last_;
  int samples_ = 0;
  Eigen::Quaterniond q_L_B_ = Eigen::Quaterniond::Identity();  // heading arbitrary
  Eigen::Vector3d gyro_bias_ = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 6, 6> P_ = Eigen::Matrix<double, 6, 6>::Zero();  // [theta (B), gyro bias]
  double turning_radps_ = 0.0;                                           // smoothed |w|
  double surplus_mps2_ = 0.0;                                            // smoothed ||a| - g|
};

}  // namespace crepes
