/// Robots of which not all hear each other.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <queue>
#include <set>
#include <vector>

#include "net/mesh/peer_link.hpp"

namespace crepes::mesh_hops_test {
namespace {

using std::chrono::milliseconds;

/// Links on one clock, 25 reports a second each.
class Robots {
 public:
  using Hears = bool (*)(std::size_t, std::size_t);

  Robots(std::size_t count, Hears hears) : hears_(hears) {
    std::vector<RobotId> members;
    for (std::size_t i = 0; i < count; ++i) members.push_back(id(i));
    for (std::size_t i = 0; i < count; ++i) links.emplace_back(id(i), members);
    samples_.resize(count);
  }

  void run(double seconds) {
    const Timestamp end = now_ + from_seconds(seconds);
    for (; now_ < end; now_ += milliseconds{1}, ++step_) {
      for (std::size_t i = 0; i < links.size(); ++i) {
        if ((step_ + 7 * i) % 40 == 0) send(i, links[i].compose(report(i), now_));
        for (const auto& datagram : links[i].forwards(now_)) send(i, datagram);
      }
      for (; !wire_.empty() && wire_.front().arrives <= now_; wire_.pop()) receive(wire_.front());
    }
  }

  [[nodiscard]] std::uint64_t total(MeshCounter counter) const {
    std::uint64_t sum = 0;
    for (const PeerLink& link : links) sum += link.counters()[counter];
    return sum;
  }
  /// Inertial samples that `to` has of `from`.
  [[nodiscard]] std::size_t samples(std::size_t to, std::size_t from) const {
    const auto found = samples_[to].find(id(from));
    return found == samples_[to].end() ? 0 : found->second.size();
  }
  void forget_samples() {
    std::ranges::for_each(samples_, [](auto& known) { known.clear(); });
  }
  [[nodiscard]] Timestamp now() const { return now_; }
  static RobotId id(std::size_t index) { return RobotId{static_cast<std::uint16_t>(index + 1)}; }

  std::vector<PeerLink> links;

 private:
  struct Packet {
    Timestamp arrives;
    std::size_t from;
    std::vector<std::uint8_t> bytes;
  };

  [[nodiscard]] Report report(std::size_t index) const {
    Report report;
    report.sender = id(index);
    report.stamp = now_;
    report.tilt = {now_, Eigen::Vector3d::UnitZ(), 0.01};
    for (int i = 0; i < 52; ++i)
      report.imu.push_back({now_ - milliseconds{10 * i + to_ns(now_) / 1'000'000 % 10},
                            {0.1, 0.0, 0.0},
                            {0.0, 0.0, 9.81}});
    return report;
  }

  void send(std::size_t from, std::vector<std::uint8_t> bytes) {
    wire_.push({now_ + milliseconds{2}, from, std::move(bytes)});
  }

  void receive(const Packet& packet) {
    const Endpoint address =
        Endpoint::ipv4({10, 0, 0, static_cast<std::uint8_t>(packet.from + 1)}, 47474);
    for (std::size_t to = 0; to < links.size(); ++to) {
      if (to == packet.from || !hears_(to, packet.from)) continue;
      const auto received = links[to].receive(packet.bytes, now_, std::nullopt, address);
      if (!received) continue;
      auto& known = samples_[to][received->report.sender];
      for (const ImuSample& sample : received->report.imu)
        known.insert((to_ns(sample.stamp) + 5'000'000) / 10'000'000);
    }
  }

  Hears hears_;
  Timestamp now_{std::chrono::seconds{100}};
  std::size_t step_ = 0;
  std::queue<Packet> wire_;
  std::vector<std::map<RobotId, std::set<std::int64_t>>> samples_;  ///< by receiver: times
};

bool in_a_line(std::size_t a, std::size_t b) { return a + 1 == b || b + 1 == a; }
bool all_hear_all(std::size_t /*a*/, std::size_t /*b*/) { return true; }

TEST(MeshHops, RobotsAtTheEndsOfALineOfFourHaveEachOthersSamples) {
  Robots robots(4, in_a_line);
  robots.run(10.0);
  robots.forget_samples();

  robots.run(4.0);

  for (const auto& [to, from] : {std::pair{0U, 3U}, {3U, 0U}, {0U, 2U}, {1U, 3U}})
    EXPECT_GE(robots.samples(to, from), 360U) << to << " of " << from;
}

TEST(MeshHops, FewDatagramsGoAcrossHops) {
  Robots robots(3, in_a_line);
  robots.run(2.0);
  const std::uint64_t before = robots.total(MeshCounter::kForwarded);

  robots.run(5.0);

  const auto forwarded = static_cast<double>(robots.total(MeshCounter::kForwarded) - before) / 5.0;
  EXPECT_NEAR(forwarded, 2 * 25.0 / 6.0, 1.5) << "of both ends, by the middle, of 50 a second";
}

TEST(MeshHops, WhatIsNotForwardedIsNotCountedAsLost) {
  Robots robots(3, in_a_line);
  robots.run(6.0);

  for (const PeerTraffic& traffic : robots.links[0].traffic(robots.now())) {
    EXPECT_LT(traffic.lost, 3U) << traffic.peer.value;
    EXPECT_LT(traffic.loss, 0.05) << traffic.peer.value;
  }
}

TEST(MeshHops, WhatNeighborsForwardOfOursIsOnTheAirToo) {
  Robots robots(3, in_a_line);
  robots.run(8.0);

  const MeshCounters& counters = robots.links[0].counters();
  EXPECT_GT(counters[MeshCounter::kReceivedAgain], 15U) << "four a second, by the middle";
  EXPECT_LE(counters[MeshCounter::kReceivedAgain], robots.total(MeshCounter::kForwarded));
}

TEST(MeshHops, NothingIsForwardedWhereAllHearAll) {
  Robots robots(6, all_hear_all);

  robots.run(4.0);

  EXPECT_EQ(robots.total(MeshCounter::kForwarded), 0U);
  EXPECT_EQ(robots.total(MeshCounter::kReceivedAgain), 0U);
}

TEST(MeshHops, ClocksAcrossHopsAreKnown) {
  Robots robots(3, in_a_line);
  robots.run(10.0);

  const auto clocks = robots.links[0].clocks();
  ASSERT_EQ(clocks.size(), 2U);
  EXPECT_NEAR(clocks[1].offset_s, 0.0, 5e-3);
}

}  // namespace
}  // namespace crepes::mesh_hops_test
