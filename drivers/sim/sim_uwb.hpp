/// A simulated ranging module.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "drivers/sim/world.hpp"
#include "drivers/uwb/nlink_frame.hpp"
#include "estimator/core/result.hpp"
#include "estimator/core/sensor_noise.hpp"
#include "estimator/core/swarm_config.hpp"

namespace crepes {

/// One robot's module: NodeFrame3 bytes with ranges to all other robots. Both modules of a pair
/// share its bias. Non-line-of-sight ranges are too long and have a weak first path.
class SimUwb {
 public:
  /// Refuses members without a robot in the world and module ids that do not fit the frame.
  /// `world` must outlive this.
  [[nodiscard]] static Result<SimUwb> make(const SimWorld& world, RobotId robot,
                                           const SwarmConfig& swarm, const RangeNoise& config);

  /// The bytes of one frame at world time `t_s`.
  [[nodiscard]] std::vector<std::uint8_t> sample(double t_s) const;

 private:
  struct Module {
    RobotId robot{};
    std::uint8_t id = 0;
    Eigen::Vector3d p_body_uwb = Eigen::Vector3d::Zero();
  };

  SimUwb(const SimWorld& world, RangeNoise config) : world_(world), config_(std::move(config)) {}
  [[nodiscard]] NlinkNode measure(const Module& other, double t_s) const;

  const SimWorld& world_;
  RangeNoise config_;
  Module self_;
  std::vector<Module> others_;
};

}  // namespace crepes
