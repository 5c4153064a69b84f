/// Sessions of a peer as a link tells them apart: restarts, replayed and forged datagrams, and a
/// second robot with the same id.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

#include "net/mesh/peer_link.hpp"
#include "net/mesh/peer_message.hpp"
#include "net/mesh/sequence_window.hpp"
#include "tests/net/mesh/mesh_of_two.hpp"

namespace crepes::peer_sessions_test {
namespace {

using std::chrono::milliseconds;
using test::kSeal;
using test::MeshOfTwo;

TEST(PeerLink, StartsAgainWhenAPeerReboots) {
  MeshOfTwo mesh;
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

TEST(PeerLink, IsNotMisledByAReplayedSession) {
  MeshOfTwo mesh;
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
  MeshOfTwo mesh;
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
  MeshOfTwo mesh;
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
  MeshOfTwo mesh;
  mesh.run_until(103.0);
  mesh.twin.emplace(RobotId{2}, std::vector{RobotId{1}, RobotId{2}});
  mesh.received.clear();

  mesh.run_until(106.0);

  EXPECT_GT(mesh.received.size(), 140U);
  EXPECT_EQ(mesh.one.traffic(Timestamp{}).at(0).restarts, 0U);
  EXPECT_GT(mesh.count_of_one("refused_doubled_id"), 100U);
}

TEST(PeerLink, DoesNotTakeAQuickRestartForASecondRobot) {
  MeshOfTwo mesh;
  mesh.run_until(103.0);
  mesh.two = PeerLink(RobotId{2}, {RobotId{1}, RobotId{2}});
  mesh.received.clear();

  mesh.run_until(104.0);

  EXPECT_GT(mesh.received.size(), 15U);
  EXPECT_FALSE(mesh.one.doubled_id());
}

TEST(PeerLink, IsNotSilencedByOneForgedNumber) {
  MeshOfTwo mesh;
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
  MeshOfTwo mesh;
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
  MeshOfTwo mesh;
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

}  // namespace
}  // namespace crepes::peer_sessions_test
