/// What stands between robots in some scenarios, beside the pillars of the simulated world.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "drivers/sim/world.hpp"

namespace crepes::study {

enum class Obstacles : std::uint8_t {
  kNone,
  kThinPillars,  ///< nine within the robots' circle: light and radio are blocked
  kFence,        ///< a row of posts across it, askew: light is blocked, radio passes
};

class ObstacleField {
 public:
  /// Thin pillars stand a little elsewhere for each seed.
  ObstacleField(Obstacles kind, int seed);

  [[nodiscard]] bool blocks_light(const Eigen::Vector3d& p_W_from,
                                  const Eigen::Vector3d& p_W_to) const;
  [[nodiscard]] bool blocks_radio(const Eigen::Vector3d& p_W_from,
                                  const Eigen::Vector3d& p_W_to) const;

 private:
  bool radio_passes_;
  std::vector<Pillar> pillars_;
};

}  // namespace crepes::study
