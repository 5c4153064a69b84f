/// Swarms whose mesh is flooded with forged datagrams.
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <optional>
#include <tuple>
#include <vector>

#include "daemon/ctl/replay/swarm_replay.hpp"
#include "tests/study/simulated_swarm.hpp"

namespace crepes::flood_test {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// What a robot publishes, to the bit.
using Row = std::tuple<RobotId, RobotId, std::int64_t, std::array<double, 3>, std::array<double, 4>,
                       double>;

struct Outcome {
  std::vector<Row> poses;
  std::uint64_t refused_broken = 0;    ///< of robot 1
  std::uint64_t refused_unsigned = 0;  ///< of robot 1, by signature
};

std::uint64_t total(const RobotReport& robot, const std::string& name) {
  for (const auto& [counter, count] : robot.network)
    if (counter == name) return count;
  return 0;
}

/// A replay of sealed and signed datagrams. For two seconds, `forge` makes a hundred thousand a
/// second for robot 1 from what it hears, all from one address.
Outcome run(const study::Swarm& swarm, const std::function<Bytes(const Bytes&, int)>& forge) {
  constexpr double kFrom_s = 1.5;
  constexpr double kTo_s = 3.5;
  constexpr int kEach = 4000;  // of 25 datagrams a second
  constexpr double kPeriod_s = 0.04;
  Outcome outcome;
  ReplaySinks sinks;
  sinks.on_pose = [&](RobotId observer, const NeighborPose& pose) {
    const auto& p = pose.T_B_N.pose.p;
    const auto& q = pose.T_B_N.pose.q;
    outcome.poses.emplace_back(
        observer, pose.neighbor, to_ns(pose.stamp), std::array{p.x(), p.y(), p.z()},
        std::array{q.w(), q.x(), q.y(), q.z()}, pose.T_B_N.covariance.trace());
  };
  sinks.on_delivery = [&](RobotId /*from*/, RobotId to, double sent_s,
                          std::vector<Delivery>& deliveries) {
    if (!forge || to != RobotId{1} || sent_s < kFrom_s || sent_s > kTo_s || deliveries.empty())
      return;
    const Bytes heard = deliveries.front().bytes;
    for (int i = 0; i < kEach; ++i)
      deliveries.push_back(
          {sent_s + kPeriod_s * i / kEach, forge(heard, i), replay_address(RobotId{9})});
  };
  ReplayOptions options;
  options.sealed = true;
  const auto report = replay_dataset(swarm.dataset, std::nullopt, options, sinks);
  EXPECT_TRUE(report);
  const RobotReport& one = report->robots.at(0);
  outcome.refused_broken = total(one, "refused_seal_broken");
  outcome.refused_unsigned =
      total(one, "refused_signature_wrong") + total(one, "refused_signature_unchecked");
  return outcome;
}

TEST(Flood, OfForgedDatagramsMovesNoPose) {
  const study::Swarm swarm = study::simulate_swarm(study::kScenarios[1], 3, 4.0);
  const PacketSeal swarm_seal(replay_swarm_key());
  const PacketSeal stranger(MeshKey{{9}});
  const PacketSigner insider(replay_robot_key(RobotId{9}));

  const Outcome calm = run(swarm, nullptr);
  const Outcome by_stranger = run(swarm, [&](const Bytes& heard, int /*i*/) {
    return stranger.seal(swarm_seal.open(heard).value());
  });
  const Outcome by_insider = run(swarm, [&](const Bytes& heard, int i) {
    constexpr std::size_t kSequence = 14;
    Bytes plain = without_signature(swarm_seal.open(heard).value());
    plain[kSequence] = static_cast<std::uint8_t>(plain[kSequence] + 1 + i % 60);
    // To sign and seal each would take the test as long as the attacker.
    static Bytes forged;
    if (i < 60 && i % 10 == 0) forged = swarm_seal.seal(insider.sign(plain));
    return forged;
  });

  EXPECT_GT(calm.poses.size(), 250U);
  EXPECT_TRUE(by_stranger.poses == calm.poses);
  EXPECT_TRUE(by_insider.poses == calm.poses);
  EXPECT_GT(by_stranger.refused_broken, 180'000U);
  EXPECT_GT(by_insider.refused_unsigned, 180'000U);
  EXPECT_EQ(calm.refused_broken + calm.refused_unsigned, 0U);
}

}  // namespace
}  // namespace crepes::flood_test
