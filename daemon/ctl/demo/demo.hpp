/// crepesctl demo: a live swarm of real daemons in a simulated world.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "config/schema/config.hpp"
#include "daemon/ctl/demo/demo_summary.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Options of `crepesctl demo`.
struct DemoOptions {
  SimScenario scenario = SimScenario::kFour;
  int seed = 1;
  double for_s = 30.0;         ///< infinite: until interrupted; the last minute is scored
  std::uint16_t port = 47481;  ///< subscription port of the first robot; the others follow
  std::filesystem::path keep;  ///< where configurations and logs are kept; empty: they are removed
  std::filesystem::path run;   ///< a program that steers the robots; empty: none
  std::string view;            ///< ADDRESS:PORT of a page that shows the robots; empty: none
  bool show_table = true;      ///< live, on standard output
  std::function<void(double)> on_progress{};  ///< progress, 0..1, called regularly
};

/// Starts the daemons, compares every ordered pair with the simulated truth, and returns a summary.
/// A daemon that ends early is an error.
[[nodiscard]] Result<DemoSummary> demo(const DemoOptions& options);

}  // namespace crepes
