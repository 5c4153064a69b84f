/// A simulated inertial sensor.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "drivers/sim/seeded_noise.hpp"
#include "drivers/sim/world.hpp"
#include "estimator/core/sensor_noise.hpp"

namespace crepes {

/// The errors of one sensor triad:  measured = (I + S) true + bias(t) + noise.
class SimTriad {
 public:
  /// The sigmas of the errors that a sensor is drawn with.
  struct Sigmas {
    double bias;
    double random_walk;  ///< of the bias [unit/s/sqrt(Hz)]
    double noise;        ///< of one sample
    double scale;        ///< of each element of S: scale errors and non-orthogonality
  };

  SimTriad(SeededNoise source, const Sigmas& sigmas);
  [[nodiscard]] Eigen::Vector3d measure(const Eigen::Vector3d& truth, double dt_s);

 private:
  SeededNoise source_;
  Sigmas sigmas_;
  Eigen::Matrix3d scale_;
  Eigen::Vector3d bias_;
  std::uint64_t drawn_ = 0;
};

/// One robot's sensor: WitMotion bytes with the errors that `config` describes, and the vibration
/// of its rotors.
class SimImu {
 public:
  /// `world` must outlive this.
  SimImu(const SimWorld& world, RobotId robot, const ImuNoise& config);

  /// The bytes of one sample at world time `t_s`; times must not decrease.
  [[nodiscard]] std::vector<std::uint8_t> sample(double t_s);

 private:
  [[nodiscard]] double sample_noise(double density, double vibration) const;

  const SimWorld& world_;
  RobotId robot_;
  double period_s_;
  SimTriad gyro_;
  SimTriad accel_;
};

}  // namespace crepes
