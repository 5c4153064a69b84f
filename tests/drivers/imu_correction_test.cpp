#include "drivers/imu/imu_correction.hpp"

#include <gtest/gtest.h>

namespace crepes::imu_correction_test {
namespace {

const ImuSample kSample{.stamp = Timestamp{std::chrono::seconds(3)},
                        .gyro_radps = {0.1, -0.2, 0.3},
                        .accel_mps2 = {1.0, 2.0, 9.5}};

TEST(ImuCorrection, LeavesSamplesAloneUnlessConfiguredOtherwise) {
  const ImuSample same = ImuCorrection(ImuDeviceConfig{}).apply(kSample);

  EXPECT_EQ(same.stamp, kSample.stamp);
  EXPECT_EQ(same.gyro_radps, kSample.gyro_radps);
  EXPECT_EQ(same.accel_mps2, kSample.accel_mps2);
}

TEST(ImuCorrection, TakesOffTheBiasThenScalesThenStraightensThenTurns) {
  ImuDeviceConfig config;
  config.accelerometer.bias = {0.5, 1.0, -0.5};
  config.accelerometer.scale = {2.0, 1.5, 0.5};
  config.accelerometer.misalignment << 1, 0.1, 0, 0, 1, 0, 0, 0, 1;
  // The sensor's x points to the left, its y backward.
  config.T_body_imu.q = Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()));

  const ImuSample sample = ImuCorrection(config).apply(kSample);

  // T K (v - b) = T (2 * 0.5, 1.5 * 1, 0.5 * 10) = (1 + 0.15, 1.5, 5)
  EXPECT_TRUE(sample.accel_mps2.isApprox(Eigen::Vector3d(-1.5, 1.15, 5.0)));
  EXPECT_TRUE(sample.gyro_radps.isApprox(Eigen::Vector3d(0.2, 0.1, 0.3)));
}

}  // namespace
}  // namespace crepes::imu_correction_test
