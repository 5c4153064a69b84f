/// crepesctl demo: a live swarm of real daemons in a simulated world.
#pragma once

#include <cstdint>
#include <filesystem>

#include "estimator/core/config.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

struct DemoOptions {
  SimScenario scenario = SimScenario::kFour;
  int seed = 1;
  double for_s = 30.0;
  std::uint16_t port = 47481;  ///< of the first robot's subscription; the others follow
  std::filesystem::path keep;  ///< where configurations and logs stay; empty: nowhere
};

/// Starts the daemons, shows every ordered pair against the simulated truth, sums up. An error if a
/// pair never got a pose or a daemon died.
[[nodiscard]] Result<void> demo(const DemoOptions& options);

}  // namespace crepes
