/// crepesctl demo: a live swarm of real daemons in a simulated world.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "daemon/ctl/demo_summary.hpp"
#include "estimator/core/config.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

struct DemoOptions {
  SimScenario scenario = SimScenario::kFour;
  int seed = 1;
  double for_s = 30.0;
  std::uint16_t port = 47481;  ///< of the first robot's subscription; the others follow
  std::filesystem::path keep;  ///< where configurations and logs stay; empty: nowhere
  bool show_table = true;      ///< a live one on standard output
  std::function<void(double)> on_progress{};  ///< share done, 0..1, now and then
};

/// Starts the daemons, shows every ordered pair against the simulated truth, sums up. An error if a
/// daemon died.
[[nodiscard]] Result<DemoSummary> demo(const DemoOptions& options);

}  // namespace crepes
