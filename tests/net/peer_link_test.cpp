#include "net/peer_link.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <queue>
#include <random>
#include <set>

namespace crepes {
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
      if (step_ % 20 == 10) send(one, empty_report(RobotId{1}), local_of_one());
      while (!wire_.empty() && wire_.top().arrives <= now_s_) {
        const Packet packet = wire_.top();
        wire_.pop();
        if (const auto report = one.receive(packet.bytes, local_of_one()))
          received.push_back(*report);
        (void)two.receive(packet.bytes, local_of_two());
      }
    }
  }

  [[nodiscard]] Timestamp local_of_one() const { return Timestamp{from_seconds(now_s_)}; }
  [[nodiscard]] Timestamp local_of_two() const {
    return Timestamp{from_seconds(now_s_) + offset_of_two};
  }
  [[nodiscard]] std::uint64_t count_of_one(const std::string& name) const {
    for (const auto& [counter, total] : one.counters())
      if (counter == name) return total;
    return 0;
  }

  PeerLink one{RobotId{1}, {RobotId{1}, RobotId{2}}};
  PeerLink two{RobotId{2}, {RobotId{1}, RobotId{2}}};
  Duration offset_of_two = std::chrono::hours{2};
  std::vector<ReceivedReport> received;

 private:
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
    auto bytes = from.compose(report, now);
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

TEST(PeerLink, TellsEveryMeasurementOnceAlthoughOneDatagramInThreeIsLost) {
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

TEST(PeerLink, StartsAnewWhenAPeerReboots) {
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

TEST(PeerLink, RefusesAndCountsWhatIsNotOfTheSwarm) {
  Mesh mesh;
  mesh.run_until(102.0);
  PeerLink stranger(RobotId{9}, {RobotId{1}, RobotId{9}});
  PeerLink impostor(RobotId{1}, {RobotId{1}, RobotId{2}});
  Report report;
  report.stamp = mesh.local_of_one();
  const std::vector<std::uint8_t> garbage(50, 0xAA);
  const auto tell = [&](const std::vector<std::uint8_t>& bytes) {
    return mesh.one.receive(bytes, mesh.local_of_one()).has_value();
  };

  report.sender = RobotId{9};
  EXPECT_FALSE(tell(stranger.compose(report, report.stamp)));
  report.sender = RobotId{1};
  EXPECT_FALSE(tell(impostor.compose(report, report.stamp)));
  EXPECT_FALSE(tell(mesh.one.compose(report, report.stamp)));
  EXPECT_FALSE(tell(garbage));

  EXPECT_EQ(mesh.count_of_one("refused_unknown_sender"), 1U);
  EXPECT_EQ(mesh.count_of_one("refused_own_id"), 1U);
  EXPECT_EQ(mesh.count_of_one("refused_foreign"), 1U);
  mesh.received.clear();
  mesh.run_until(103.0);
  EXPECT_GT(mesh.received.size(), 40U);
}

TEST(PeerLink, TakesADatagramThatComesTwiceOnce) {
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

TEST(PeerLink, SaysNothingOfAPeerThatDoesNotHearUs) {
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

TEST(SequenceWindow, CountsLossesAndForgivesLateComers) {
  SequenceWindow window;
  using Verdict = SequenceWindow::Verdict;

  EXPECT_EQ(window.accept(10), Verdict::kNew);
  EXPECT_EQ(window.accept(13), Verdict::kNew);
  EXPECT_EQ(window.lost(), 2U);
  EXPECT_EQ(window.accept(11), Verdict::kNew);
  EXPECT_EQ(window.accept(11), Verdict::kDuplicate);
  EXPECT_EQ(window.lost(), 1U);
  EXPECT_EQ(window.accept(1000), Verdict::kNew);
  EXPECT_EQ(window.accept(13), Verdict::kTooOld);
  EXPECT_EQ(window.received(), 4U);
}

}  // namespace
}  // namespace crepes
