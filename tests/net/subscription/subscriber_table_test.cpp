#include "net/subscription/subscriber_table.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <random>

namespace crepes::subscriber_table_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Timestamp kStart{seconds{1000}};
constexpr RobotId kNeighbor{2};

Endpoint client(std::uint16_t port) { return Endpoint::ipv4({127, 0, 0, 1}, port); }

SubscriptionConfig config_for(int subscribers) {
  SubscriptionConfig config;
  config.max_subscribers = subscribers;
  return config;
}

/// Poses that one client receives of 50 a second during ten seconds, with jitter in their stamps.
std::size_t poses_in_ten_seconds(std::optional<double> rate_hz) {
  SubscriberTable table{SubscriptionConfig{}};
  EXPECT_TRUE(table.watch(client(1), {.enable = true, .rate_hz = rate_hz, .peers = {}}, kStart));
  std::mt19937 random(1);
  std::uniform_int_distribution<int> jitter(-300, 300);
  std::size_t count = 0;
  for (int i = 0; i < 500; ++i)
    count += table
                 .deliveries(kNeighbor, kStart + milliseconds{20 * i} +
                                            std::chrono::microseconds{jitter(random)})
                 .size();
  return count;
}

TEST(SubscriberTable, ServesEachClientAtItsOwnRate) {
  EXPECT_EQ(poses_in_ten_seconds(std::nullopt), 500U);
  EXPECT_EQ(poses_in_ten_seconds(200.0), 500U);
  EXPECT_NEAR(static_cast<double>(poses_in_ten_seconds(50.0)), 500.0, 5.0);
  EXPECT_NEAR(static_cast<double>(poses_in_ten_seconds(10.0)), 100.0, 2.0);
  EXPECT_NEAR(static_cast<double>(poses_in_ten_seconds(0.5)), 5.0, 1.0);
}

TEST(SubscriberTable, CountsTheRateOfEachNeighborByItself) {
  SubscriberTable table{SubscriptionConfig{}};
  ASSERT_TRUE(table.watch(client(1), {.enable = true, .rate_hz = 10.0, .peers = {}}, kStart));

  EXPECT_EQ(table.deliveries(RobotId{2}, kStart).size(), 1U);
  EXPECT_EQ(table.deliveries(RobotId{3}, kStart).size(), 1U);
  EXPECT_EQ(table.deliveries(RobotId{3}, kStart + milliseconds{20}).size(), 0U);
}

TEST(SubscriberTable, CountsAllAddressesOfThisMachineAsOne) {
  SubscriberTable table(config_for(32));
  int admitted = 0;
  for (std::uint8_t i = 1; i <= 32; ++i) {
    const Endpoint address = Endpoint::ipv4({127, 0, i, i}, 5000);
    admitted += table.watch(address, {}, kStart) ? 1 : 0;
  }

  EXPECT_EQ(admitted, SubscriptionConfig{}.max_per_address);
  EXPECT_TRUE(table.watch(Endpoint::ipv4({10, 0, 0, 7}, 5000), {}, kStart));
}

TEST(SubscriberTable, NumbersTheDatagramsOfAClient) {
  SubscriberTable table{SubscriptionConfig{}};
  ASSERT_TRUE(table.watch(client(1), {}, kStart));

  EXPECT_EQ(table.deliveries(RobotId{2}, kStart).at(0).sequence, 0U);
  EXPECT_EQ(table.deliveries(RobotId{3}, kStart).at(0).sequence, 1U);
}

TEST(SubscriberTable, SendsOnlyTheNeighborsAskedFor) {
  SubscriberTable table{SubscriptionConfig{}};
  ASSERT_TRUE(
      table.watch(client(1), {.enable = true, .rate_hz = {}, .peers = {{RobotId{3}}}}, kStart));

  EXPECT_TRUE(table.deliveries(RobotId{2}, kStart).empty());
  EXPECT_EQ(table.deliveries(RobotId{3}, kStart).size(), 1U);
}

TEST(SubscriberTable, EndsALeaseThatIsNotRenewed) {
  SubscriberTable table{SubscriptionConfig{}};
  ASSERT_TRUE(table.watch(client(1), {}, kStart));
  ASSERT_TRUE(table.watch(client(2), {}, kStart));
  ASSERT_TRUE(table.watch(client(1), {}, kStart + seconds{8}));

  table.expire(kStart + seconds{11});

  const auto deliveries = table.deliveries(kNeighbor, kStart + seconds{11});
  ASSERT_EQ(deliveries.size(), 1U);
  EXPECT_EQ(deliveries[0].client, client(1));
}

TEST(SubscriberTable, EndsASubscriptionOnRequest) {
  SubscriberTable table{SubscriptionConfig{}};
  ASSERT_TRUE(table.watch(client(1), {}, kStart));

  ASSERT_TRUE(table.watch(client(1), {.enable = false, .rate_hz = {}, .peers = {}}, kStart));

  EXPECT_EQ(table.size(), 0U);
}

TEST(SubscriberTable, RefusesOneTooManyUntilALeaseEnds) {
  SubscriberTable table{config_for(2)};
  ASSERT_TRUE(table.watch(client(1), {}, kStart));
  ASSERT_TRUE(table.watch(client(2), {}, kStart));

  const auto refused = table.watch(client(3), {}, kStart + seconds{1});
  const auto renewed = table.watch(client(2), {}, kStart + seconds{1});
  const auto later = table.watch(client(3), {}, kStart + seconds{10} + milliseconds{1});

  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("at most 2"), std::string::npos);
  EXPECT_TRUE(renewed);
  EXPECT_TRUE(later);
}

TEST(SubscriberTable, AllowsOneErrorASecondForEachClient) {
  SubscriberTable table{SubscriptionConfig{}};

  EXPECT_TRUE(table.allows_error(client(1), kStart));
  EXPECT_FALSE(table.allows_error(client(1), kStart + milliseconds{999}));
  EXPECT_TRUE(table.allows_error(client(2), kStart + milliseconds{999}));
  EXPECT_TRUE(table.allows_error(client(1), kStart + milliseconds{1000}));
}

TEST(SubscriberTable, StoresABoundedNumberOfClientsWithErrors) {
  SubscriberTable table{SubscriptionConfig{}};
  int admitted = 0;
  for (int port = 1; port < 60000; ++port)
    admitted += table.allows_error(client(static_cast<std::uint16_t>(port)), kStart) ? 1 : 0;

  EXPECT_LT(admitted, 1000);
  EXPECT_TRUE(table.allows_error(client(60000), kStart + seconds{2}));
}

TEST(SubscriberTable, AllowsAnErrorHereWhateverOtherMachinesSend) {
  SubscriberTable table{SubscriptionConfig{}};
  for (std::uint16_t port = 1; port <= 1000; ++port)
    (void)table.allows_error(Endpoint::ipv4({10, 0, 0, 1}, port), kStart);

  EXPECT_FALSE(table.allows_error(Endpoint::ipv4({10, 0, 0, 2}, 1), kStart));
  EXPECT_TRUE(table.allows_error(client(1), kStart));
}

TEST(SubscriberTable, GivesAnAddressItsShareAndLeavesRoomForOthers) {
  SubscriberTable table{SubscriptionConfig{}};
  for (std::uint16_t port = 1; port <= 4; ++port)
    ASSERT_TRUE(table.watch(client(port), {}, kStart));

  const auto refused = table.watch(client(5), {}, kStart);
  const auto renewed = table.watch(client(4), {}, kStart);
  const auto elsewhere = table.watch(Endpoint::ipv4({10, 0, 0, 2}, 1), {}, kStart);

  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("at this address, at most 4"), std::string::npos);
  EXPECT_TRUE(renewed);
  EXPECT_TRUE(elsewhere);
}

TEST(SubscriberTable, HasWhoAsksTooMuchGiveWayToWhoDoesNot) {
  SubscriberTable table{SubscriptionConfig{}};
  for (std::uint16_t port = 1; port <= 4; ++port)
    ASSERT_TRUE(table.watch(client(port), {}, kStart));
  for (int i = 0; i < 1000; ++i) (void)table.allows(client(3), kStart);

  const auto elsewhere = Endpoint::ipv4({10, 0, 0, 2}, 1);
  ASSERT_TRUE(table.watch(elsewhere, {}, kStart));
  const auto greedy = table.watch(client(7), {}, kStart + seconds{1}, 0, /*is_light_user=*/false);
  const auto newcomer = table.watch(client(5), {}, kStart + seconds{1}, 0, /*is_light_user=*/true);
  const auto another = table.watch(client(6), {}, kStart + seconds{1}, 0, /*is_light_user=*/true);

  EXPECT_FALSE(greedy);
  EXPECT_TRUE(newcomer);
  EXPECT_FALSE(another);
  EXPECT_FALSE(table.allows(client(3), kStart + seconds{1}).has_value());
  for (const Endpoint& kept : {client(1), client(2), client(4), client(5), elsewhere})
    EXPECT_EQ(table.allows(kept, kStart + seconds{1}), true) << kept.to_string();
}

TEST(SubscriberTable, ForgivesAfterALease) {
  SubscriberTable table{SubscriptionConfig{}};
  const auto renew = [&](Timestamp now) {
    for (std::uint16_t port = 1; port <= 4; ++port) ASSERT_TRUE(table.watch(client(port), {}, now));
  };
  renew(kStart);
  for (int i = 0; i < 1000; ++i) (void)table.allows(client(3), kStart);

  renew(kStart + seconds{6});
  renew(kStart + seconds{12});

  EXPECT_FALSE(table.watch(client(5), {}, kStart + seconds{12}, 0, /*is_light_user=*/true));
}

TEST(SubscriberTable, HasRoomForThirtyTwoOfWhichFourAreForThisMachine) {
  SubscriberTable table{SubscriptionConfig{}};
  for (std::uint8_t host = 1; host <= 7; ++host)
    for (std::uint16_t port = 1; port <= 4; ++port)
      ASSERT_TRUE(table.watch(Endpoint::ipv4({10, 0, 0, host}, port), {}, kStart));

  const auto refused = table.watch(Endpoint::ipv4({10, 0, 0, 9}, 1), {}, kStart);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("at most 28"), std::string::npos);
  for (std::uint16_t port = 1; port <= 4; ++port)
    EXPECT_TRUE(table.watch(client(port), {}, kStart)) << port;
  EXPECT_EQ(table.size(), 32U);
}

TEST(SubscriberTable, LeavesHalfOfASmallTableToOtherMachines) {
  SubscriberTable table{config_for(2)};

  EXPECT_TRUE(table.watch(Endpoint::ipv4({10, 0, 0, 1}, 1), {}, kStart));
  EXPECT_FALSE(table.watch(Endpoint::ipv4({10, 0, 0, 2}, 1), {}, kStart));
  EXPECT_TRUE(table.watch(client(1), {}, kStart));
}

TEST(SubscriberTable, AnswersOverTheSocketThatTheClientAsked) {
  SubscriberTable table{SubscriptionConfig{}};
  ASSERT_TRUE(table.watch(client(1), {}, kStart, 3));

  EXPECT_EQ(table.deliveries(RobotId{2}, kStart).at(0).socket, 3U);
}

TEST(SubscriberTable, CountsTheRequestsOfASubscriberByThemselves) {
  SubscriberTable table{SubscriptionConfig{}};
  ASSERT_TRUE(table.watch(client(1), {}, kStart));

  int admitted = 0;
  for (int i = 0; i < 1000; ++i) admitted += table.allows(client(1), kStart).value() ? 1 : 0;

  EXPECT_EQ(admitted, 100);
  EXPECT_TRUE(table.allows(client(1), kStart + milliseconds{20}).value());
  EXPECT_FALSE(table.allows(client(2), kStart).has_value());
}

}  // namespace
}  // namespace crepes::subscriber_table_test
