#include "net/mesh/send_pacing.hpp"

#include <gtest/gtest.h>

#include <chrono>

#include "net/mesh/peer_message.hpp"

namespace crepes {
namespace {

TEST(SendPacing, RepeatsUntilOneInFiveHundredIsLost) {
  EXPECT_EQ(copies_for(0.0), 2U);
  EXPECT_EQ(copies_for(0.1), 3U);
  EXPECT_EQ(copies_for(0.33), 6U);
  EXPECT_EQ(copies_for(1.0), 6U);
}

TEST(SendPacing, DividesTheAirAmongThoseThatAreHeard) {
  const SendSettings settings{.rate_hz = 25, .air_kbps = 1000};

  EXPECT_EQ(datagram_bytes({.rate_hz = 25, .air_kbps = 1e5}, 4), 396U);   // 9.9 kB/s
  EXPECT_EQ(datagram_bytes({.rate_hz = 25, .air_kbps = 1e5}, 19), 456U);  // 11.4 kB/s
  EXPECT_EQ(datagram_bytes(settings, 9), 416U);                           // the cap, not 12.5 kB/s
  EXPECT_EQ(datagram_bytes(settings, 14), 333U);                          // a fifteenth of 125 kB/s
  EXPECT_EQ(datagram_bytes(settings, 100), kMinPeerMessage);
}

TEST(SendPacing, CountsTheAirOfThreeBroadcastsADatagram) {
  // 400 bytes and 92 of headers at 6 Mbit/s: 660 us of symbols, 20 of preamble, 101.5 of waiting.
  EXPECT_NEAR(airtime(25, 400, 6), 25 * 3 * (660 + 20 + 101.5) * 1e-6, 1e-9);
  EXPECT_LT(airtime(25, 400, 24), 0.5 * airtime(25, 400, 6));
}

TEST(SendPacing, AddsUpTheSharesOfAllThatIsHeardOrLost) {
  const AirTotals before{.at = Timestamp{}, .sent = 10, .sent_bytes = 5000, .received = 100};
  AirTotals after = before;
  after.at += std::chrono::seconds{2};
  EXPECT_EQ(air_share(before, after, 6).all, 0.0);
  after.sent += 50;
  after.sent_bytes += 50 * 400;
  after.received += 75;
  after.received_bytes += 75 * 300;
  after.lost += 25;

  const AirShare share = air_share(before, after, 6);

  EXPECT_DOUBLE_EQ(share.own, airtime(25, 400, 6));
  EXPECT_DOUBLE_EQ(share.all, airtime(25, 400, 6) + airtime(50, 300, 6));
  EXPECT_EQ(air_share(after, after, 6).all, 0.0);
}

}  // namespace
}  // namespace crepes
