#include "drivers/sim/sim_imu.hpp"

#include <cmath>

#include "drivers/imu/witmotion.hpp"

namespace crepes {
namespace {

constexpr std::uint64_t kGyro = 0x6779726fU;
constexpr std::uint64_t kAccel = 0x616363656cU;

SeededNoise noise_of(std::uint64_t sensor, const SimWorld& world, RobotId robot) {
  return SeededNoise{sensor, static_cast<std::uint64_t>(world.seed()), robot.value};
}

}  // namespace

SimTriad::SimTriad(SeededNoise source, const Sigmas& sigmas)
    : source_(source),
      sigmas_(sigmas),
      scale_(sigmas.scale * source_.gaussian3(0)),
      bias_(sigmas.bias * source_.gaussian3(1)),
      drawn_(2) {}

Eigen::Vector3d SimTriad::measure(const Eigen::Vector3d& truth, double dt_s) {
  bias_ += sigmas_.random_walk * std::sqrt(dt_s) * source_.gaussian3(drawn_++);
  return truth + scale_.cwiseProduct(truth) + bias_ + sigmas_.noise * source_.gaussian3(drawn_++);
}

SimImu::SimImu(const SimWorld& world, RobotId robot, const ImuConfig& config)
    : world_(world),
      robot_(robot),
      period_s_(1.0 / config.update_rate),
      gyro_(noise_of(kGyro, world, robot),
            {config.gyroscope_bias_sigma, config.gyroscope_random_walk,
             config.gyroscope_noise_density * std::sqrt(config.update_rate), config.scale_sigma}),
      accel_(noise_of(kAccel, world, robot),
             {config.accelerometer_bias_sigma, config.accelerometer_random_walk,
              config.accelerometer_noise_density * std::sqrt(config.update_rate),
              config.scale_sigma}) {}

std::vector<std::uint8_t> SimImu::sample(double t_s) {
  // A sensor that integrates inside sends the mean since its last sample.
  const BodyState body = world_.state(robot_, t_s - 0.5 * period_s_);
  const auto bytes = encode_witmotion(gyro_.measure(body.w_W_B_B, period_s_),
                                      accel_.measure(body.specific_force(), period_s_));
  return {bytes.begin(), bytes.end()};
}

}  // namespace crepes
