#include "estimator/calibration/batch/knot_noise.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace crepes {
namespace {

constexpr double kAngleSlack = 1e-5;     // [rad] of integration within a sample, by knot
constexpr double kVelocitySlack = 2e-4;  // [m/s]
constexpr double kPositionSlack = 2e-5;  // [m]
constexpr double kLeastWalk = 1e-7;

}  // namespace

ArrowSystem::StateMatrix knot_whitening(const ImuNoise& noise, double dt) {
  const auto square = [](double x) { return x * x; };
  const double gyro = square(noise.gyroscope_noise_density) * dt + square(kAngleSlack);
  const double a2 = square(noise.accelerometer_noise_density);
  Eigen::Matrix2d vp;
  vp << a2 * dt + square(kVelocitySlack), a2 * dt * dt / 2.0, a2 * dt * dt / 2.0,
      a2 * dt * dt * dt / 3.0 + square(kPositionSlack);
  const Eigen::Matrix2d U = vp.inverse().llt().matrixU();
  const double gyro_walk = std::max(kLeastWalk, noise.gyroscope_random_walk) * std::sqrt(dt);
  const double accel_walk = std::max(kLeastWalk, noise.accelerometer_random_walk) * std::sqrt(dt);
  ArrowSystem::StateMatrix L = ArrowSystem::StateMatrix::Zero();
  for (int i = 0; i < 3; ++i) {
    L(i, i) = 1.0 / std::sqrt(gyro);
    L(3 + i, 3 + i) = U(0, 0);
    L(3 + i, 6 + i) = U(0, 1);
    L(6 + i, 6 + i) = U(1, 1);
    L(9 + i, 9 + i) = 1.0 / gyro_walk;
    L(12 + i, 12 + i) = 1.0 / accel_walk;
  }
  return L;
}

}  // namespace crepes
