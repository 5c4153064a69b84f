/// How a recorded IMU differs from an ideal one.
#pragma once

#include <Eigen/Core>

#include "daemon/ctl/dataset/swarm_dataset.hpp"
#include "tests/study/true_motion.hpp"

namespace crepes::study {

struct MeasuredImuNoise {
  double gyro_density = 0.0;   ///< white, vibration included [rad/s/sqrt(Hz)]
  double accel_density = 0.0;  ///< [m/s^2/sqrt(Hz)]
  Eigen::Vector3d gyro_bias_radps = Eigen::Vector3d::Zero();  ///< mean of measured minus true
  Eigen::Vector3d accel_bias_mps2 = Eigen::Vector3d::Zero();
};

/// Densities from fourth differences of measured minus true, in which motion, seen as means over a
/// sample here and at instants there, cancels.
[[nodiscard]] MeasuredImuNoise imu_noise(const RobotRecording& robot, const TrueMotion& truth);

}  // namespace crepes::study
