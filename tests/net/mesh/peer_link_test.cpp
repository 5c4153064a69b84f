#include "net/mesh/peer_link.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <optional>
#include <queue>
#include <random>
#include <set>

namespace crepes::peer_link_test {
namespace {

using std::chrono::milliseconds;

/// Two robots; robot 2's clock is `offset` ahead of robot 1's.
class Mesh {
 public:
  explicit Mesh(double loss = 0.0, double jitter_s = 0.003)
      : loss_(loss), jitter_s_(jitter_s), random_(3) {}

  /// Runs until `end_s` of robot 1's clock; robot 2 reports IMU samples, each of them 8 times.
  void run_until(double end_s) {
    for (; now_s_ < end_s; now_s_ += 0.001, ++step_) {
      if (step_ % 20 == 0) send(two, report_of_two(), local_of_two());
      if (step_ % 20 == 5 && twin) send(*twin, empty_report(RobotId{2}), local_of_two());
      if (step_ % 20 == 10) send(one, empty_report(RobotId{1}), local_of_one());
      for (int i = 0; i < 3 && !to_replay.empty(); ++i, to_replay.pop_front())
        deliver_to_one(to_replay.front());
      while (!wire_.empty() && wire_.top().arrives <= now_s_) {
        const Packet packet = wire_.top();
        wire_.pop();
        deliver_to_one(packet.bytes);
        (void)two.receive(packet.bytes, local_of_two(), seal_of_two);
        if (twin) (void)twin->receive(packet.bytes, local_of_two());
      }
    }
  }

  [[nodiscard]] Timestamp local_of_one() const { return Timestamp{from_seconds(now_s_)}; }
  [[nodiscard]] Timestamp local_of_two() const {
    return Timestamp{from_seconds(now_s_) + offset_of_two};
  }
  [[nodiscard]] std::uint64_t count_of_one(const std::string& name) const {
    for (const auto& [counter, total] : one.counters().totals())
      if (counter == name) return total;
    return 0;
  }

  PeerLink one{RobotId{1}, {RobotId{1}, RobotId{2}}};
  PeerLink two{RobotId{2}, {RobotId{1}, RobotId{2}}};
  std::optional<PeerLink> twin;  ///< also uses id 2
  Duration offset_of_two = std::chrono::hours{2};
  std::optional<PacketSeal> seal_of_one;
  std::optional<PacketSeal> seal_of_two;
  std::vector<ReceivedReport> received;               ///< by robot 1
  std::deque<std::vector<std::uint8_t>> sent_by_two;  ///< all datagrams
  std::deque<std::vector<std::uint8_t>> to_replay;    ///< to robot 1, three a ms

 private:
  void deliver_to_one(const std::vector<std::uint8_t>& bytes) {
    if (const auto report = one.receive(bytes, local_of_one(), seal_of_one))
      received.push_back(*report);
  }

  struct Packet {
    double arrives;
    std::vector<std::uint8_t> bytes;
    bool operator<(const Packet& other) const { return arrives > other.arrives; }
  };

  [[nodiscard]] Report empty_report(RobotId sender) const {
    Report report;
    report.sender = sender;
    report.stamp = sender == RobotId{1} ? local_of_one() : local_of_two();
    report.tilt = {report.stamp, Eigen::Vector3d::UnitZ(), 0.01};
    return report;
  }

  Report report_of_two() {
    Report report = empty_report(RobotId{2});
    for (int i = 0; i < 16; ++i)
      report.imu.push_back(
          {report.stamp - milliseconds{10 * i}, {0.0, 0.0, now_s_ - 0.01 * i}, {0, 0, 9.81}});
    return report;
  }

  void send(PeerLink& from, const Report& report, Timestamp now) {
    std::uniform_real_distribution<double> uniform(0, 1);
    auto bytes = from.compose(report, now, &from == &one ? seal_of_one : seal_of_two);
    if (&from == &two) sent_by_two.push_back(bytes);
    if (uniform(random_) >= loss_)
      wire_.push({now_s_ + 0.003 + jitter_s_ * uniform(random_), std::move(bytes)});
  }

  double loss_;
  double jitter_s_;
  std::mt19937 random_;
  double now_s_ = 100.0;
  int step_ = 0;
  std::priority_queue<Packet> wire_;
};

TEST(PeerLink, BringsReportsToOurTimeline) {
  Mesh mesh;

  mesh.run_until(103.0);

  ASSERT_GT(mesh.received.size(), 100U);
  const auto& sample = mesh.received.back().report.imu.front();
  EXPECT_NEAR(to_seconds(sample.stamp.time_since_epoch()), sample.gyro_radps.z(), 2e-3);
  ASSERT_EQ(mesh.one.clocks().size(), 1U);
  EXPECT_NEAR(mesh.one.clocks()[0].offset_s, 7200.0, 1e-3);
  EXPECT_LT(mesh.received.back().clock_sigma_s, 1e-3);
}

TEST(PeerLink, ReportsEveryMeasurementOnceAlthoughOneDatagramInThreeIsLost) {
  Mesh mesh(0.33, 0.060);
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

TEST(PeerLink, StartsAgainWhenAPeerReboots) {
  Mesh mesh;
  mesh.run_until(105.0);
  mesh.received.clear();

  mesh.two = PeerLink(RobotId{2}, {RobotId{1}, RobotId{2}});
  mesh.offset_of_two = std::chrono::seconds{-99};
  mesh.run_until(107.0);

  ASSERT_FALSE(mesh.received.empty());
  for (const auto& received : mesh.received)
    EXPECT_NEAR(to_seconds(received.report.stamp.time_since_epoch()), 106.0, 1.1);
  EXPECT_NEAR(mesh.one.clocks().at(0).offset_s, -99.0, 1e-3);
  EXPECT_EQ(mesh.one.traffic(Timestamp{}).at(0).restarts, 1U);
}

TEST(PeerLink, RefusesAndCountsForeignDatagrams) {
  Mesh mesh;
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
  Mesh mesh;
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

const PacketSeal kSeal(MeshKey{1, 2, 3});
const PacketSeal kOtherSeal(MeshKey{1, 2, 4});

TEST(PeerLink, OpensSealedDatagramsOfPeers) {
  Mesh mesh;
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
    Mesh mesh;
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
  Mesh lossless;
  Mesh lossy(0.33);
  lossless.run_until(106.0);
  lossy.run_until(106.0);

  const auto traffic = lossy.one.traffic(Timestamp{});
  ASSERT_EQ(traffic.size(), 1U);
  EXPECT_NEAR(traffic[0].loss, 0.33, 0.15);
  EXPECT_LT(lossless.one.traffic(Timestamp{}).at(0).loss, 0.01);
  const auto samples = [](const Mesh& mesh) {
    return decode_peer_message(mesh.sent_by_two.back()).value().report.imu.size();
  };
  EXPECT_EQ(samples(lossy), 16U);    // all that robot 2 has
  EXPECT_EQ(samples(lossless), 8U);  // two periods of 40 ms
}

TEST(PeerLink, IsNotMisledByAReplayedSession) {
  Mesh mesh;
  mesh.seal_of_one = mesh.seal_of_two = kSeal;
  const auto restart_two = [&](Duration offset) {
    mesh.two = PeerLink(RobotId{2}, {RobotId{1}, RobotId{2}});
    mesh.offset_of_two = offset;
  };
  const auto expect_all_well_among = [&](const auto& recorded, double from_s, double to_s) {
    mesh.received.clear();
    for (int i = 0; i < 20; ++i)
      mesh.to_replay.insert(mesh.to_replay.end(), recorded.begin(), recorded.end());
    mesh.run_until(to_s);
    EXPECT_GT(static_cast<double>(mesh.received.size()), 50 * (to_s - from_s) * 0.9);
    for (const auto& received : mesh.received) {
      const double stamp_s = to_seconds(received.report.stamp.time_since_epoch());
      EXPECT_GT(stamp_s, from_s - 0.1);
      EXPECT_LT(stamp_s, to_s + 0.1);
    }
  };
  mesh.run_until(103.0);
  const auto first_session = mesh.sent_by_two;
  restart_two(std::chrono::hours{3});
  mesh.run_until(106.0);
  mesh.sent_by_two.clear();
  restart_two(std::chrono::hours{1});
  mesh.run_until(108.0);
  const auto current_session = mesh.sent_by_two;

  expect_all_well_among(first_session, 108.0, 110.0);
  expect_all_well_among(current_session, 110.0, 112.0);
  EXPECT_EQ(mesh.one.traffic(Timestamp{}).at(0).restarts, 2U);

  // A robot that starts now cannot know which of the sessions is genuine.
  mesh.one = PeerLink(RobotId{1}, {RobotId{1}, RobotId{2}});
  expect_all_well_among(first_session, 112.1, 114.0);
  EXPECT_EQ(mesh.one.traffic(Timestamp{}).at(0).restarts, 0U);
  EXPECT_NEAR(mesh.one.clocks().at(0).offset_s, 3600.0, 1e-3);
}

TEST(PeerLink, RemembersTheLatestSixteenSessionsOfAPeer) {
  Mesh mesh;
  std::vector<std::deque<std::vector<std::uint8_t>>> sessions;
  double now_s = 101.0;
  for (int restarts = 0; restarts < 20; ++restarts) {
    mesh.run_until(now_s += 1.2);
    sessions.push_back(std::exchange(mesh.sent_by_two, {}));
    mesh.two = PeerLink(RobotId{2}, {RobotId{1}, RobotId{2}});
  }
  mesh.run_until(now_s += 1.2);
  ASSERT_EQ(mesh.one.traffic(Timestamp{}).at(0).restarts, 20U);
  const auto refused_of = [&](std::size_t session) {
    const std::uint64_t before = mesh.count_of_one("refused_old_session");
    mesh.to_replay = sessions.at(session);
    mesh.received.clear();
    mesh.run_until(now_s += 0.5);
    EXPECT_GT(mesh.received.size(), 20U);  // the peer's own datagrams
    return mesh.count_of_one("refused_old_session") - before;
  };

  EXPECT_EQ(refused_of(4), sessions[4].size());
  EXPECT_EQ(refused_of(3), 0U);  // forgotten: as one that never echoes us
  EXPECT_EQ(mesh.one.traffic(Timestamp{}).at(0).restarts, 20U);
}

TEST(PeerLink, KnowsAPeerAgainWhenASecondRobotWithItsIdHasLeft) {
  Mesh mesh;
  mesh.run_until(103.0);
  mesh.twin.emplace(RobotId{2}, std::vector{RobotId{1}, RobotId{2}});
  mesh.run_until(106.0);
  ASSERT_TRUE(mesh.one.doubled_id());
  EXPECT_EQ(mesh.one.doubled_id()->robot, RobotId{2});
  EXPECT_GT(mesh.count_of_one("refused_doubled_id"), 0U);
  ASSERT_TRUE(mesh.two.doubled_id());  // hears its own id
  mesh.twin.reset();
  mesh.run_until(108.0);
  mesh.received.clear();

  mesh.run_until(109.0);

  EXPECT_GT(mesh.received.size(), 45U);
  EXPECT_NEAR(mesh.one.clocks().at(0).offset_s, 7200.0, 1e-3);
}

TEST(PeerLink, KeepsToThePeerThatWasThereFirst) {
  Mesh mesh;
  mesh.run_until(103.0);
  mesh.twin.emplace(RobotId{2}, std::vector{RobotId{1}, RobotId{2}});
  mesh.received.clear();

  mesh.run_until(106.0);

  EXPECT_GT(mesh.received.size(), 140U);
  EXPECT_EQ(mesh.one.traffic(Timestamp{}).at(0).restarts, 0U);
  EXPECT_GT(mesh.count_of_one("refused_doubled_id"), 100U);
}

TEST(PeerLink, DoesNotTakeAQuickRestartForASecondRobot) {
  Mesh mesh;
  mesh.run_until(103.0);
  mesh.two = PeerLink(RobotId{2}, {RobotId{1}, RobotId{2}});
  mesh.received.clear();

  mesh.run_until(104.0);

  EXPECT_GT(mesh.received.size(), 15U);
  EXPECT_FALSE(mesh.one.doubled_id());
}

TEST(PeerLink, IsNotSilencedByOneForgedNumber) {
  Mesh mesh;
  mesh.run_until(103.0);
  PeerMessage forged = decode_peer_message(mesh.sent_by_two.back()).value();
  for (const std::uint32_t ahead : {1U << 31U, 10'000U, 60U}) {
    OutgoingPeerMessage message;
    message.report.sender = RobotId{2};
    message.report.stamp = message.sent = mesh.local_of_two();
    message.report.tilt = {message.sent, Eigen::Vector3d::UnitZ(), 0.01};
    message.session = forged.session;
    message.sequence = forged.sequence + ahead;
    (void)mesh.one.receive(encode_peer_message(message).bytes, mesh.local_of_one());
  }
  EXPECT_EQ(mesh.count_of_one("refused_too_far_ahead"), 2U);
  mesh.received.clear();

  mesh.run_until(105.0);

  EXPECT_GT(mesh.received.size(), 90U);
}

TEST(PeerLink, HearsAPeerThatWasOutOfRangeForAnHour) {
  SequenceWindow window;
  ASSERT_EQ(window.accept(7, 0), SequenceWindow::Verdict::kNew);
  Mesh mesh;
  mesh.run_until(102.0);
  Report report;
  report.sender = RobotId{2};
  for (int i = 0; i < 50 * 3600; ++i) (void)mesh.two.compose(report, mesh.local_of_two());
  report.stamp = mesh.local_of_two() + std::chrono::hours{1};
  report.tilt.stamp = report.stamp;
  const auto bytes = mesh.two.compose(report, report.stamp);

  (void)mesh.one.receive(bytes, mesh.local_of_one() + std::chrono::hours{1});

  EXPECT_EQ(mesh.count_of_one("refused_too_far_ahead"), 0U);
}

TEST(PeerLink, RefusesAnEchoOfWhatItNeverSent) {
  Mesh mesh;
  mesh.run_until(100.5);
  OutgoingPeerMessage message;
  message.report.sender = RobotId{2};
  message.report.stamp = message.sent = mesh.local_of_two();
  message.session = 77;
  message.echoes = {{RobotId{1}, echo_code(to_ns(mesh.local_of_one() - milliseconds{7}) + 13),
                     to_ns(message.sent - milliseconds{5}), 0.0}};

  EXPECT_FALSE(mesh.one.receive(encode_peer_message(message).bytes, mesh.local_of_one()));

  EXPECT_EQ(mesh.count_of_one("refused_echo"), 1U);
  EXPECT_EQ(mesh.one.traffic(Timestamp{}).at(0).restarts, 0U);
}

TEST(SequenceWindow, CountsLossesButNotLateDatagrams) {
  SequenceWindow window;
  using Verdict = SequenceWindow::Verdict;

  EXPECT_EQ(window.accept(10, 1000), Verdict::kNew);
  EXPECT_EQ(window.accept(13, 1000), Verdict::kNew);
  EXPECT_EQ(window.lost(), 2U);
  EXPECT_EQ(window.accept(11, 1000), Verdict::kNew);
  EXPECT_EQ(window.accept(11, 1000), Verdict::kDuplicate);
  EXPECT_EQ(window.lost(), 1U);
  EXPECT_EQ(window.accept(1000, 1000), Verdict::kNew);
  EXPECT_EQ(window.accept(13, 1000), Verdict::kTooOld);
  EXPECT_EQ(window.accept(2001, 1000), Verdict::kTooFarAhead);
  EXPECT_EQ(window.received(), 4U);
}

}  // namespace
}  // namespace crepes::peer_link_test
