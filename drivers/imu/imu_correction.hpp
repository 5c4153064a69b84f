/// Applies calibration and mounting to IMU samples.
#pragma once

#include <Eigen/Core>

#include "drivers/imu/imu_config.hpp"
#include "estimator/core/measurements.hpp"

namespace crepes {

/// The only place that applies the configured calibration and mounting:
///   v_B = R_B_S T K (v_S - b),  S the sensor,  for rates and specific force alike
/// (Tedaldi, Pretto, Menegatti: A robust and easy to implement method for IMU calibration without
/// external equipments, ICRA 2014).
class ImuCorrection {
 public:
  explicit ImuCorrection(const ImuDeviceConfig& config)
      : gyro_(triad(config.gyroscope, config.T_body_imu)),
        accel_(triad(config.accelerometer, config.T_body_imu)) {}

  [[nodiscard]] ImuSample apply(const ImuSample& sample) const {
    return {.stamp = sample.stamp,
            .gyro_radps = gyro_.M * (sample.gyro_radps - gyro_.bias),
            .accel_mps2 = accel_.M * (sample.accel_mps2 - accel_.bias)};
  }

 private:
  struct Triad {
    Eigen::Matrix3d M;
    Eigen::Vector3d bias;
  };

  static Triad triad(const TriadConfig& config, const Pose& T_body_imu) {
    return {T_body_imu.R() * config.misalignment * config.scale.asDiagonal(), config.bias};
  }

  Triad gyro_;
  Triad accel_;
};

}  // namespace crepes
