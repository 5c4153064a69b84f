#include "drivers/sim/sim_imu.hpp"

#include <array>
#include <cmath>

#include "drivers/imu/witmotion.hpp"

namespace crepes {
namespace {

constexpr std::uint64_t kGyro = 0x6779726fU;
constexpr std::uint64_t kAccel = 0x616363656cU;

// Noise of each sample from rotors, one sigma.
constexpr double kGyroVibration = 0.0052;  // rad/s
constexpr double kAccelVibration = 0.2;    // m/s^2

SeededNoise noise_of(std::uint64_t sensor, const SimWorld& world, RobotId robot) {
  return SeededNoise{sensor, static_cast<std::uint64_t>(world.seed()), robot.value};
}

}  // namespace

SimTriad::SimTriad(SeededNoise source, const Sigmas& sigmas)
    : source_(source), sigmas_(sigmas), bias_(sigmas.bias * source_.gaussian3(1)), drawn_(4) {
  constexpr std::array<std::uint64_t, 3> kColumns{0, 2, 3};
  for (std::size_t axis = 0; axis < kColumns.size(); ++axis) {
    scale_.col(static_cast<Eigen::Index>(axis)) =
        sigmas.scale * source_.gaussian3(kColumns.at(axis));
  }
}

Eigen::Vector3d SimTriad::measure(const Eigen::Vector3d& truth, double dt_s) {
  bias_ += sigmas_.random_walk * std::sqrt(dt_s) * source_.gaussian3(drawn_++);
  return truth + scale_ * truth + bias_ + sigmas_.noise * source_.gaussian3(drawn_++);
}

SimImu::SimImu(const SimWorld& world, RobotId robot, const ImuNoise& config)
    : world_(world),
      robot_(robot),
      period_s_(1.0 / config.update_rate),
      gyro_(noise_of(kGyro, world, robot),
            {.bias = config.gyroscope_bias_sigma,
             .random_walk = config.gyroscope_random_walk,
             .noise = sample_noise(config.gyroscope_noise_density, kGyroVibration),
             .scale = config.gyroscope_scale_sigma}),
      accel_(noise_of(kAccel, world, robot),
             {.bias = config.accelerometer_bias_sigma,
              .random_walk = config.accelerometer_random_walk,
              .noise = sample_noise(config.accelerometer_noise_density, kAccelVibration),
              .scale = config.accelerometer_scale_sigma}) {}

double SimImu::sample_noise(double density, double vibration) const {
  return std::hypot(density / std::sqrt(period_s_), world_.has_rotors(robot_) ? vibration : 0.0);
}

std::vector<std::uint8_t> SimImu::sample(double t_s) {
  // An integrating sensor sends the mean since its last sample.
  const BodyState body = world_.state(robot_, t_s - 0.5 * period_s_);
  const auto bytes = encode_witmotion(gyro_.measure(body.w_W_B_B, period_s_),
                                      accel_.measure(body.specific_force(), period_s_));
  return {bytes.begin(), bytes.end()};
}

}  // namespace crepes
