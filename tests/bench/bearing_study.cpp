// What the tracker alone makes of recorded swarms, against their truth: bearing_study SWARM_DIR...
#include <cstdio>

#include "estimator/core/constants.hpp"
#include "tests/support/bearing_truth.hpp"

int main(int argc, char** argv) {
  using namespace crepes;
  for (int i = 1; i < argc; ++i) {
    const auto swarm = load_swarm(argv[i]);
    const auto manifest = load_manifest(argv[i]);
    if (!swarm || !manifest) return std::fprintf(stderr, "%s: unreadable\n", argv[i]), 1;
    const auto truth = SwarmTruth::load(argv[i], *manifest);
    if (!truth) return std::fprintf(stderr, "%s\n", truth.error().message.c_str()), 1;
    for (const RobotRecording& robot : swarm->robots)
      for (const auto& [id, seen] : test::watch_neighbors(robot, *truth, std::chrono::seconds{2}))
        std::printf(
            "%-14s %s sees %d: visible %6zu identified %6.2f %% wrong %3zu rms %.4f deg\n",
            swarm->manifest.scenario.c_str(), robot.robot.name.c_str(), id.value, seen.visible,
            100.0 * static_cast<double>(seen.identified) / static_cast<double>(seen.visible),
            seen.wrong, kDegPerRad * seen.rms_rad());
  }
  return 0;
}
