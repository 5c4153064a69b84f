#include "net/mesh/peer_link.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "net/mesh/packet_seal.hpp"
#include "net/mesh/peer_message.hpp"
#include "net/mesh/send_pacing.hpp"
#include "tests/net/mesh/mesh_of_two.hpp"

namespace crepes::peer_link_test {
namespace {

using std::chrono::milliseconds;
using test::kSeal;
using test::MeshOfTwo;

TEST(PeerLink, BringsReportsToOurTimeline) {
  MeshOfTwo mesh;

  mesh.run_until(103.0);

  ASSERT_GT(mesh.received.size(), 100U);
  const auto& sample = mesh.received.back().report.imu.front();
  EXPECT_NEAR(to_seconds(sample.stamp.time_since_epoch()), sample.gyro_radps.z(), 2e-3);
  ASSERT_EQ(mesh.one.clocks().size(), 1U);
  EXPECT_NEAR(mesh.one.clocks()[0].offset_s, 7200.0, 1e-3);
  EXPECT_LT(mesh.received.back().clock_sigma_s, 1e-3);
}

TEST(PeerLink, ReportsEveryMeasurementOnceAlthoughOneDatagramInThreeIsLost) {
  MeshOfTwo mesh(0.33, 0.060);
  mesh.run_until(110.0);

  std::vector<double> stamps;
  for (const auto& received : mesh.received)
    for (const auto& sample : received.report.imu)
      if (sample.gyro_radps.z() > 102.0 && sample.gyro_radps.z() < 109.5)
        stamps.push_back(std::round(sample.gyro_radps.z() * 100));
  const std::set<double> distinct(stamps.begin(), stamps.end());

  EXPECT_EQ(stamps.size(), distinct.size());
  EXPECT_GE(distinct.size(), 745U);  // of 750: eight copies all lost is 1 in 7000
  const auto traffic = mesh.one.traffic(Timestamp{});
  ASSERT_EQ(traffic.size(), 1U);
  EXPECT_NEAR(static_cast<double>(traffic[0].lost), 165.0, 50.0);
}

// An IMU's samples are believed late where others must confirm them.
TEST(PeerLink, SendsSamplesThatAreBelievedLateHoweverOldTheyAre) {
  MeshOfTwo mesh;
  mesh.run_until(102.0);
  Report report;
  report.sender = RobotId{2};
  for (int i = 1; i <= 20; ++i) {
    report.stamp = mesh.local_of_two() + milliseconds{10 * i};
    report.imu.push_back({.stamp = report.stamp,
                          .gyro_radps = Eigen::Vector3d::Zero(),
                          .accel_mps2 = Eigen::Vector3d::UnitZ()});
  }
  const auto bytes = mesh.two.compose(report, report.stamp);

  const auto received = mesh.one.receive(bytes, mesh.local_of_one() + milliseconds{203});

  ASSERT_TRUE(received.has_value());
  EXPECT_EQ(received->report.imu.size(), 20U);
}

TEST(PeerLink, RefusesAndCountsForeignDatagrams) {
  MeshOfTwo mesh;
  mesh.run_until(102.0);
  PeerLink stranger(RobotId{9}, {RobotId{1}, RobotId{9}});
  PeerLink impostor(RobotId{1}, {RobotId{1}, RobotId{2}});
  Report report;
  report.stamp = mesh.local_of_one();
  const std::vector<std::uint8_t> garbage(50, 0xAA);
  const auto accepts = [&](const std::vector<std::uint8_t>& bytes) {
    return mesh.one.receive(bytes, mesh.local_of_one()).has_value();
  };

  report.sender = RobotId{9};
  EXPECT_FALSE(accepts(stranger.compose(report, report.stamp)));
  report.sender = RobotId{1};
  EXPECT_FALSE(accepts(impostor.compose(report, report.stamp)));
  EXPECT_FALSE(accepts(mesh.one.compose(report, report.stamp)));
  EXPECT_FALSE(accepts(garbage));

  EXPECT_EQ(mesh.count_of_one("refused_unknown_sender"), 1U);
  EXPECT_EQ(mesh.count_of_one("refused_own_id"), 1U);
  EXPECT_EQ(mesh.count_of_one("refused_foreign"), 1U);
  mesh.received.clear();
  mesh.run_until(103.0);
  EXPECT_GT(mesh.received.size(), 40U);
}

TEST(PeerLink, AcceptsADatagramThatArrivesTwiceOnce) {
  MeshOfTwo mesh;
  mesh.run_until(102.0);
  Report report;
  report.sender = RobotId{2};
  report.stamp = mesh.local_of_two();
  const auto bytes = mesh.two.compose(report, mesh.local_of_two());
  const Timestamp arrival = mesh.local_of_one() + milliseconds{3};

  EXPECT_TRUE(mesh.one.receive(bytes, arrival).has_value());
  EXPECT_FALSE(mesh.one.receive(bytes, arrival).has_value());

  EXPECT_EQ(mesh.count_of_one("refused_duplicate"), 1U);
}

TEST(PeerLink, ReportsNothingOfAPeerThatDoesNotReceiveUs) {
  PeerLink one(RobotId{1}, {RobotId{1}, RobotId{2}});
  PeerLink two(RobotId{2}, {RobotId{1}, RobotId{2}});
  Report report;
  report.sender = RobotId{2};
  for (int i = 0; i < 100; ++i) {
    report.stamp = Timestamp{milliseconds{20 * i}};
    EXPECT_FALSE(
        one.receive(two.compose(report, report.stamp), Timestamp{milliseconds{20 * i + 3}}));
  }

  EXPECT_TRUE(one.clocks().empty());
  EXPECT_EQ(one.traffic(Timestamp{}).at(0).received, 100U);
}

const PacketSeal kOtherSeal(MeshKey{1, 2, 4});

TEST(PeerLink, OpensSealedDatagramsOfPeers) {
  MeshOfTwo mesh;
  mesh.seal_of_one = mesh.seal_of_two = kSeal;

  mesh.run_until(103.0);

  EXPECT_GT(mesh.received.size(), 100U);
  EXPECT_TRUE(PacketSeal::is_sealed(mesh.sent_by_two.front()));
}

TEST(PeerLink, RefusesOtherSealsAndCountsTheReason) {
  struct Case {
    std::optional<PacketSeal> ours, theirs;
    std::string reason;
  };
  for (const Case& seals : {Case{kSeal, std::nullopt, "refused_seal_missing"},
                            Case{std::nullopt, kSeal, "refused_seal_unexpected"},
                            Case{kSeal, kOtherSeal, "refused_seal_broken"}}) {
    MeshOfTwo mesh;
    mesh.seal_of_one = seals.ours;
    mesh.seal_of_two = seals.theirs;

    mesh.run_until(101.0);

    EXPECT_TRUE(mesh.received.empty());
    EXPECT_GT(mesh.count_of_one(seals.reason), 40U) << seals.reason;
    EXPECT_EQ(mesh.count_of_one(seals.reason), mesh.count_of_one("received"));
    EXPECT_TRUE(mesh.one.traffic(Timestamp{}).empty());
  }
}

TEST(PeerLink, SealedDatagramsAreNoLongerThanOthers) {
  const SendSettings settings;
  PeerLink link(RobotId{1}, {RobotId{1}, RobotId{2}}, settings);
  Report report;
  report.sender = RobotId{1};
  for (int i = 0; i < 300; ++i) {
    const RobotId neighbor{static_cast<std::uint16_t>(2 + i % 30)};
    report.ranges.push_back({report.stamp - milliseconds{i}, neighbor, 3.0, -80.0, -79.0});
  }

  for (const std::optional<PacketSeal>& seal : {std::optional<PacketSeal>{}, {kSeal}}) {
    const std::size_t size = link.compose(report, Timestamp{}, seal).size();
    EXPECT_LE(size, pace_of(settings, 0).bytes);
    EXPECT_GT(size, pace_of(settings, 0).bytes - 90);  // another copy of all
  }
}

/// Of the robots 1 to 20 hears the last: reports that are sent in a second of 25.
int datagrams_of_twenty(const SendSettings& settings) {
  std::vector<RobotId> members;
  for (std::uint16_t id = 1; id <= 20; ++id) members.emplace_back(id);
  PeerLink link(members.back(), members, settings);
  int sent = 0;
  for (int i = 0; i < 50; ++i) {
    const Timestamp now{milliseconds{40 * i}};
    Report report;
    report.stamp = now;
    for (std::size_t k = 0; k + 1 < members.size() && i % 10 == 0; ++k) {
      PeerLink peer(members[k], members);
      report.sender = members[k];
      (void)link.receive(peer.compose(report, now), now);
    }
    report.sender = members.back();
    if (!link.is_due(now)) continue;
    (void)link.compose(report, now);
    sent += i >= 25 ? 1 : 0;
  }
  return sent;
}

TEST(PeerLink, SendsFewerDatagramsWhereTheAirIsShort) {
  const SendSettings slow{.broadcasts = {.rate_mbps = 6, .repeats = 3}};
  const auto reports = static_cast<double>(pace_of(slow, 19).reports);

  EXPECT_EQ(datagrams_of_twenty({.broadcasts = {.rate_mbps = 54, .repeats = 1}}), 25);
  EXPECT_GT(reports, 1);
  EXPECT_NEAR(datagrams_of_twenty(slow), 25 / reports, 1);
}

TEST(PeerLink, RepeatsMoreWhereMoreIsLost) {
  MeshOfTwo lossless;
  MeshOfTwo lossy(0.33);
  lossless.run_until(106.0);
  lossy.run_until(106.0);

  const auto traffic = lossy.one.traffic(Timestamp{});
  ASSERT_EQ(traffic.size(), 1U);
  EXPECT_NEAR(traffic[0].loss, 0.33, 0.15);
  EXPECT_LT(lossless.one.traffic(Timestamp{}).at(0).loss, 0.01);
  const auto samples = [](const MeshOfTwo& mesh) {
    return decode_peer_message(mesh.sent_by_two.back()).value().report.imu.size();
  };
  EXPECT_EQ(samples(lossy), 16U);    // all that robot 2 has
  EXPECT_EQ(samples(lossless), 8U);  // two periods of 40 ms
}

}  // namespace
}  // namespace crepes::peer_link_test
