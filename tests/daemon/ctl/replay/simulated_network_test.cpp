#include "daemon/ctl/replay/simulated_network.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace crepes::simulated_network_test {
namespace {

constexpr int kDatagrams = 200'000;
constexpr double kPeriod_s = 0.04;

/// Of each datagram of a link, whether it is lost.
std::vector<bool> losses(SimulatedNetwork& network, RobotId to) {
  std::vector<bool> lost;
  for (int i = 0; i < kDatagrams; ++i)
    lost.push_back(!network.delay_s(RobotId{1}, to, kPeriod_s * i));
  return lost;
}

double share(const std::vector<bool>& lost) {
  return static_cast<double>(std::ranges::count(lost, true)) / kDatagrams;
}

TEST(SimulatedNetwork, LosesTheShareOneByOne) {
  SimulatedNetwork network({.latency_ms = 3, .jitter_ms = 3, .loss = 0.2, .seed = 0}, 1);
  const std::vector<bool> lost = losses(network, RobotId{2});

  EXPECT_NEAR(share(lost), 0.2, 0.01);
  int together = 0;
  for (std::size_t i = 1; i < lost.size(); ++i) together += lost[i] && lost[i - 1] ? 1 : 0;
  EXPECT_NEAR(static_cast<double>(together) / kDatagrams, 0.04, 0.005);
}

TEST(SimulatedNetwork, LosesTheSameShareInBursts) {
  SimulatedNetwork network({.latency_ms = 3, .jitter_ms = 3, .loss = 0.2, .seed = 0}, 1, 0.5);
  const std::vector<bool> lost = losses(network, RobotId{2});

  EXPECT_NEAR(share(lost), 0.2, 0.02);
  int length = 0;
  for (const bool is_lost : lost) {
    if (!is_lost && length > 0) {
      EXPECT_GE(length, 12);  // 0.5 s, or several bursts in a row
    }
    length = is_lost ? length + 1 : 0;
  }
  EXPECT_NE(losses(network, RobotId{3}), lost);  // each link by itself
}

TEST(SimulatedNetwork, ForwardsToThoseWhoDoNotHearTheSender) {
  SimulatedNetwork network({.latency_ms = 3, .jitter_ms = 0, .loss = 0, .seed = 0}, 1);
  const std::vector<RobotId> line{RobotId{1}, RobotId{2}, RobotId{3}, RobotId{4}};
  const auto hears = [](RobotId a, RobotId b) {
    return a.value + 1 == b.value || b.value + 1 == a.value;
  };

  const auto forwarded = network.delays_s(RobotId{1}, line, 0.0, true, hears);
  const auto once = network.delays_s(RobotId{1}, line, 0.0, false, hears);

  ASSERT_EQ(forwarded.size(), 3U);
  EXPECT_NEAR(forwarded.at(RobotId{4}), 0.009, 1e-9);
  ASSERT_EQ(once.size(), 1U);
  EXPECT_NEAR(once.at(RobotId{2}), 0.003, 1e-9);
}

TEST(SimulatedNetwork, LosesNothingWithoutLoss) {
  SimulatedNetwork network({.latency_ms = 3, .jitter_ms = 3, .loss = 0, .seed = 0}, 1, 0.5);

  EXPECT_EQ(share(losses(network, RobotId{2})), 0.0);
}

}  // namespace
}  // namespace crepes::simulated_network_test
