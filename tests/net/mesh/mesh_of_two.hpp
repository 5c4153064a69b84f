/// Two robots that exchange datagrams over a network with loss, on virtual time.
#pragma once

#include <Eigen/Core>
#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <queue>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "net/mesh/packet_seal.hpp"
#include "net/mesh/peer_link.hpp"

namespace crepes::test {

/// The swarm's seal.
inline const PacketSeal kSeal(MeshKey{1, 2, 3});

/// Robot 2's clock is `offset_of_two` ahead of robot 1's.
class MeshOfTwo {
 public:
  explicit MeshOfTwo(double loss = 0.0, double jitter_s = 0.003)
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
      report.imu.push_back({report.stamp - std::chrono::milliseconds{10 * i},
                            {0.0, 0.0, now_s_ - 0.01 * i},
                            {0, 0, 9.81}});
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

}  // namespace crepes::test
