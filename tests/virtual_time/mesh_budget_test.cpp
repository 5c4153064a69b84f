/// What a robot takes of the air in a replay: bounds that must not be exceeded again.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "daemon/ctl/replay/swarm_replay.hpp"
#include "tests/study/crowd.hpp"
#include "tests/study/simulated_swarm.hpp"

namespace crepes::mesh_budget_test {
namespace {

/// Of the robot that sends the most, sealed and signed.
struct Sent {
  double datagrams_per_s = 0.0;
  double bytes_per_s = 0.0;
  double airtime_of_all = 0.0;  ///< share of the channel
};

Sent sent_in(const study::Swarm& swarm, double loss) {
  ReplayOptions options;
  options.sealed = true;
  options.loss = loss;
  ReplaySinks sinks;
  sinks.on_pose = [](RobotId /*observer*/, const NeighborPose& /*pose*/) {};
  const auto report = replay_dataset(swarm.dataset, std::nullopt, options, sinks);
  EXPECT_TRUE(report);
  Sent most;
  for (const RobotReport& robot : report->robots) {
    most.datagrams_per_s = std::max(most.datagrams_per_s,
                                    static_cast<double>(robot.datagrams_sent) / report->duration_s);
    most.bytes_per_s =
        std::max(most.bytes_per_s, static_cast<double>(robot.bytes_sent) / report->duration_s);
    most.airtime_of_all += robot.airtime;
  }
  std::printf(
      "%zu robots, %.0f %% lost: at most %.1f datagrams, %.0f bytes a second; %.1f %% of the air\n",
      report->robots.size(), 100 * loss, most.datagrams_per_s, most.bytes_per_s,
      100 * most.airtime_of_all);
  return most;
}

TEST(MeshBudget, OfFourRobotsIsTenKilobytesEachOnTheWorstLinks) {
  const study::Swarm swarm = study::simulate_swarm(study::kScenarios[2], 3, 4.0);

  const Sent calm = sent_in(swarm, 0.02);
  const Sent bad = sent_in(swarm, 0.33);

  EXPECT_LT(calm.bytes_per_s, 8'200);
  EXPECT_LT(calm.airtime_of_all, 0.215);
  EXPECT_LT(bad.bytes_per_s, 10'000);
  EXPECT_LT(bad.airtime_of_all, 0.24);
  for (const Sent& sent : {calm, bad}) EXPECT_LE(sent.datagrams_per_s, 25.5);
}

TEST(MeshBudget, OfTwelveRobotsIsHalfOfASlowChannel) {
  const study::Swarm swarm =
      study::simulate_crowd({.robots = 12, .rings = 1, .radius_m = 4.0}, 3, 3.0);

  const Sent sent = sent_in(swarm, 0.02);

  EXPECT_LT(sent.bytes_per_s, 10'000);
  EXPECT_LE(sent.airtime_of_all, 0.5);
}

}  // namespace
}  // namespace crepes::mesh_budget_test
