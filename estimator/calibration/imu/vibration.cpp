#include "estimator/calibration/imu/vibration.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace crepes {
namespace {

double measured_density(std::span<const ImuSample> imu, double period_s,
                        const Eigen::Vector3d ImuSample::*signal, int order) {
  std::vector<Eigen::Vector3d> differences;
  differences.reserve(imu.size());
  for (const ImuSample& sample : imu) differences.push_back(sample.*signal);
  // White noise of variance 1 becomes that of (2 n)! / (n!)^2.
  double growth = 1.0;
  for (int n = 1; n <= order; ++n) {
    for (std::size_t i = 0; i + 1 < differences.size(); ++i)
      differences[i] = differences[i + 1] - differences[i];
    differences.pop_back();
    growth *= (4.0 * n - 2.0) / n;
  }
  double sum = 0.0;
  for (const Eigen::Vector3d& each : differences) sum += each.squaredNorm();
  return std::sqrt(period_s * sum / (3.0 * growth * static_cast<double>(differences.size())));
}

}  // namespace

ImuNoise noise_with_vibration(const ImuNoise& configured, std::span<const ImuSample> imu,
                              int order) {
  ImuNoise noise = configured;
  if (imu.size() < static_cast<std::size_t>(order) + 1) return noise;
  const double period_s =
      to_seconds(imu.back().stamp - imu.front().stamp) / static_cast<double>(imu.size() - 1);
  noise.gyroscope_noise_density =
      std::max(noise.gyroscope_noise_density,
               measured_density(imu, period_s, &ImuSample::gyro_radps, order));
  noise.accelerometer_noise_density =
      std::max(noise.accelerometer_noise_density,
               measured_density(imu, period_s, &ImuSample::accel_mps2, order));
  return noise;
}

}  // namespace crepes
