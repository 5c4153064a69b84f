/// The white noise of an IMU that moves.
#include "estimator/calibration/imu/vibration.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "tests/support/calibration_recording.hpp"

namespace crepes::vibration_test {
namespace {

constexpr int kOrderForHands = 8;

/// A minute of a body at rest that trembles with this frequency, 2 m/s^2 along x.
std::vector<ImuSample> trembling(double hz, double noise_density) {
  simulated::Dice dice(1);
  std::vector<ImuSample> imu;
  for (int i = 1; i <= 6000; ++i) {
    const double t_s = 0.01 * i;
    const double push = hz > 0.0 ? 2.0 * std::sin(2.0 * std::numbers::pi * hz * t_s) : 0.0;
    imu.push_back({.stamp = Timestamp{from_seconds(t_s)},
                   .gyro_radps = dice.vector(noise_density),
                   .accel_mps2 = dice.vector(noise_density / 0.1) +
                                 Eigen::Vector3d(push, 0.0, kNominalGravityMps2)});
  }
  return imu;
}

double accelerometer_density(const std::vector<ImuSample>& imu, int order) {
  return noise_with_vibration(ImuNoise{}, imu, order).accelerometer_noise_density;
}

TEST(NoiseWithVibration, IsThatOfANoisierSensorThanConfigured) {
  const double density = 5.0 * ImuNoise{}.accelerometer_noise_density;
  for (const int order : {2, 4, kOrderForHands})
    EXPECT_NEAR(accelerometer_density(trembling(0.0, density), order), density, 0.05 * density);
}

TEST(NoiseWithVibration, IsNeverLessThanConfigured) {
  const double configured = ImuNoise{}.accelerometer_noise_density;
  EXPECT_EQ(accelerometer_density(trembling(0.0, 0.1 * configured), kOrderForHands), configured);
}

TEST(NoiseWithVibration, HardlyCountsAHandThatTrembles) {
  const double density = ImuNoise{}.accelerometer_noise_density;
  EXPECT_LT(accelerometer_density(trembling(12.0, density), kOrderForHands), 1.1 * density);
  // A motor shakes faster, and what it does between two samples is noise.
  EXPECT_GT(accelerometer_density(trembling(45.0, density), kOrderForHands), 10.0 * density);
}

}  // namespace
}  // namespace crepes::vibration_test
