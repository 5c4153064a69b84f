/// A data set in which a member is seen that it does not list.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "daemon/ctl/replay/swarm_replay.hpp"
#include "tests/study/simulated_swarm.hpp"

namespace crepes::unlisted_member_test {
namespace {

TEST(UnlistedMember, IsSeenAndHasNoTruth) {
  constexpr RobotId kUnlisted{4};
  SimConfig sim;
  sim.scenario = SimScenario::kFour;
  const SimWorld world(sim);
  auto robots = demo_swarm(sim, world.robots(), 0.0, 40000, 40100);
  std::erase_if(robots, [&](const DemoRobot& r) { return r.config.robot.id == kUnlisted; });
  const study::Scenario& four =
      *std::ranges::find(study::kScenarios, "four", &study::Scenario::name);
  const study::Swarm swarm = study::simulate_swarm(four, world, std::move(robots), 4.0);
  ReplaySinks sinks;
  sinks.on_pose = [](RobotId, const NeighborPose&) {};

  const auto report = replay_dataset(swarm.dataset, std::optional(swarm.truth), {}, sinks);

  ASSERT_TRUE(report) << report.error().message;
  ASSERT_EQ(report->robots.size(), 3U);
  std::uint64_t decodes = 0;
  for (const RobotReport& robot : report->robots) {
    if (robot.id_mistakes) {
      EXPECT_FALSE(robot.id_mistakes->contains(kUnlisted));
    }
    for (const NeighborStatus& neighbor : robot.status.neighbors)
      if (neighbor.neighbor == kUnlisted) decodes += neighbor.id_decodes;
  }
  EXPECT_GT(decodes, 0U);
}

}  // namespace
}  // namespace crepes::unlisted_member_test
