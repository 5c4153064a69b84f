#include "net/mesh/send_pacing.hpp"

#include <gtest/gtest.h>

#include <chrono>

#include "net/mesh/peer_message.hpp"

namespace crepes::send_pacing_test {
namespace {

TEST(SendPacing, RepeatsUntilOneInFiveHundredIsLost) {
  EXPECT_EQ(copies_for(0.0), 2U);
  EXPECT_EQ(copies_for(0.1), 3U);
  EXPECT_EQ(copies_for(0.33), 6U);
  EXPECT_EQ(copies_for(1.0), 6U);
}

constexpr Broadcasts kSlow{.rate_mbps = 6, .repeats = 3};
constexpr Broadcasts kFast{.rate_mbps = 1000, .repeats = 1};

double datagrams_per_s(const SendSettings& settings, const Pace& pace) {
  return settings.rate_hz / static_cast<double>(pace.reports);
}

TEST(SendPacing, SendsNoMoreThanNeededWhereThereIsAir) {
  const SendSettings settings{.rate_hz = 25, .broadcasts = kFast};
  for (const std::size_t neighbors : {0U, 4U, 19U, 49U})
    EXPECT_EQ(pace_of(settings, neighbors).reports, 1U) << neighbors;

  EXPECT_EQ(pace_of(settings, 4).bytes, 396U);   // 9.9 kB/s
  EXPECT_EQ(pace_of(settings, 19).bytes, 456U);  // 11.4 kB/s
  EXPECT_EQ(pace_of({.rate_hz = 25, .broadcasts = kSlow}, 4).bytes, 396U);
}

TEST(SendPacing, FitsSwarmsOfFiftyIntoTheirShareOfTheAir) {
  for (const double rate_mbps : {6.0, 12.0, 24.0}) {
    for (const double airtime_of_all : {0.4, 0.5, 0.8}) {
      for (std::size_t neighbors = 0; neighbors < 50; ++neighbors) {
        const SendSettings settings{.airtime_of_all = airtime_of_all,
                                    .broadcasts = {.rate_mbps = rate_mbps, .repeats = 3}};
        const Pace pace = pace_of(settings, neighbors);
        const double all = static_cast<double>(neighbors + 1) *
                           airtime(datagrams_per_s(settings, pace), static_cast<double>(pace.bytes),
                                   settings.broadcasts);
        const bool is_least = airtime_of_all < 0.5 && pace.bytes == kMinPeerMessage;
        EXPECT_TRUE(all <= airtime_of_all || is_least) << neighbors << " at " << rate_mbps;
      }
    }
  }
}

TEST(SendPacing, SendsFewerAndFullerDatagramsWhereTheAirIsShort) {
  const SendSettings settings{.broadcasts = kSlow};
  const Pace of_five = pace_of(settings, 4);
  EXPECT_EQ(of_five.reports, 1U);
  std::size_t before = 1;
  for (const std::size_t neighbors : {9U, 19U, 29U}) {
    const Pace pace = pace_of(settings, neighbors);
    EXPECT_GT(pace.reports, before) << neighbors;
    EXPECT_GT(pace.bytes, of_five.bytes) << neighbors;
    before = pace.reports;
  }
}

TEST(SendPacing, NeverFallsSilent) {
  const Pace pace = pace_of({.rate_hz = 25, .airtime_of_all = 0.01, .broadcasts = kSlow}, 200);

  EXPECT_EQ(pace.reports, 6U);
  EXPECT_EQ(pace.bytes, kMinPeerMessage);
  EXPECT_EQ(pace_of({.rate_hz = 2, .broadcasts = kSlow}, 200).reports, 1U);
}

TEST(SendPacing, UsesAllOfItsAir) {
  const SendSettings settings{.broadcasts = kSlow};
  const Pace pace = pace_of(settings, 19);
  const auto air_of = [&](std::size_t bytes) {
    return 20 * airtime(datagrams_per_s(settings, pace), static_cast<double>(bytes), kSlow);
  };

  EXPECT_LE(air_of(pace.bytes), settings.airtime_of_all);
  EXPECT_GT(air_of(pace.bytes + 4), settings.airtime_of_all);
}

TEST(SendPacing, CountsTheAirOfEveryRepeatOfADatagram) {
  // 400 bytes and 92 of headers at 6 Mbit/s: 660 us of symbols, 20 of preamble, 101.5 of waiting.
  EXPECT_NEAR(airtime(25, 400, kSlow), 25 * 3 * (660 + 20 + 101.5) * 1e-6, 1e-9);
  EXPECT_NEAR(airtime(25, 400, {.rate_mbps = 6, .repeats = 1}), airtime(25, 400, kSlow) / 3, 1e-9);
  EXPECT_LT(airtime(25, 400, {.rate_mbps = 24, .repeats = 3}), 0.5 * airtime(25, 400, kSlow));
}

TEST(SendPacing, AddsUpTheSharesOfAllThatIsHeardOrLost) {
  AirTotals before;
  before.sent = 10;
  before.sent_bytes = 5000;
  before.received = 100;
  AirTotals after = before;
  after.at += std::chrono::seconds{2};
  EXPECT_EQ(air_share(before, after, kSlow).all, 0.0);
  after.sent += 50;
  after.sent_bytes += 50 * 400;
  after.received += 75;
  after.received_bytes += 75 * 300;
  after.lost += 25;

  const AirShare share = air_share(before, after, kSlow);

  EXPECT_DOUBLE_EQ(share.own, airtime(25, 400, kSlow));
  EXPECT_DOUBLE_EQ(share.all, airtime(25, 400, kSlow) + airtime(50, 300, kSlow));
  EXPECT_EQ(air_share(after, after, kSlow).all, 0.0);
}

TEST(SendPacing, DividesTheAirAmongPeersByTheirDatagrams) {
  AirTotals before;
  before.received = 10;
  before.received_bytes = 1000;
  before.of_peers[RobotId{2}] = 10;
  AirTotals after = before;
  after.at += std::chrono::seconds{1};
  after.received += 60;
  after.received_bytes = before.received_bytes + 60 * 300;
  after.of_peers = {{RobotId{2}, 10 + 40}, {RobotId{3}, 25}};  // five of which were lost

  const AirShare share = air_share(before, after, kSlow);

  EXPECT_DOUBLE_EQ(share.of_peers.at(RobotId{2}), airtime(40, 300, kSlow));
  EXPECT_DOUBLE_EQ(share.of_peers.at(RobotId{3}), airtime(25, 300, kSlow));
  EXPECT_EQ(air_share(after, after, kSlow).of_peers.at(RobotId{2}), 0.0);
}

}  // namespace
}  // namespace crepes::send_pacing_test
