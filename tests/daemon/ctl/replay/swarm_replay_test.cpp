#include "daemon/ctl/replay/swarm_replay.hpp"

#include <gtest/gtest.h>

#include "tests/daemon/ctl/tiny_swarm.hpp"

namespace crepes::swarm_replay_test {
namespace {

TEST(SwarmReplay, TakesDelayedRobotsByNameOrId) {
  const TinySwarm swarm;
  const auto replayed = [&](const std::string& delayed) {
    ReplayOptions options;
    options.swarm_dir = swarm.dir();
    options.out_dir = swarm.dir() / "out";
    options.delays.robots = {delayed};
    const auto summary = replay_swarm(options);
    return summary ? std::string("done") : summary.error().message;
  };

  EXPECT_EQ(replayed("r2"), "done");
  EXPECT_EQ(replayed("2"), "done");
  EXPECT_NE(replayed("3").find("--delayed: no robot \"3\""), std::string::npos);
}

}  // namespace
}  // namespace crepes::swarm_replay_test
