#include "tests/study/imu_noise.hpp"

#include <cmath>
#include <vector>

namespace crepes::study {
namespace {

using Series = std::vector<Eigen::Vector3d>;

// White noise of variance s^2 has fourth differences of variance 70 s^2, on each of three axes.
double density_of(const Series& x, double period_s) {
  double sum = 0.0;
  for (std::size_t i = 4; i < x.size(); ++i)
    sum += (x[i] - 4.0 * x[i - 1] + 6.0 * x[i - 2] - 4.0 * x[i - 3] + x[i - 4]).squaredNorm();
  return std::sqrt(sum / (210.0 * static_cast<double>(x.size() - 4)) * period_s);
}

Eigen::Vector3d mean_of(const Series& x) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& one : x) sum += one;
  return sum / static_cast<double>(x.size());
}

}  // namespace

MeasuredImuNoise imu_noise(const RobotRecording& robot, const TrueMotion& truth) {
  const double period_s = 1.0 / robot.config.imu.noise.update_rate;
  Series gyro;
  Series accel;
  for (const ImuSample& sample : robot.imu) {
    const double middle_s = robot.robot.clock.true_s(sample.stamp) - 0.5 * period_s;
    const MotionSample ideal = truth.at(middle_s);
    gyro.push_back(sample.gyro_radps - ideal.w_B);
    accel.push_back(sample.accel_mps2 - ideal.f_B);
  }
  if (gyro.size() < 5) return {};
  return {density_of(gyro, period_s), density_of(accel, period_s), mean_of(gyro), mean_of(accel)};
}

}  // namespace crepes::study
