#include "tests/fuzz/mesh_target.hpp"

#include <array>
#include <chrono>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "config/schema/config.hpp"
#include "config/schema/estimator_slice.hpp"
#include "estimator/core/contract.hpp"
#include "estimator/swarm/estimator.hpp"
#include "net/mesh/crc32.hpp"
#include "net/mesh/peer_link.hpp"

namespace crepes {
namespace {

using std::chrono::milliseconds;

const RobotId kOne{1};
const RobotId kTwo{2};
constexpr std::size_t kHeader = 18;  // what decides whether a datagram is read at all
constexpr std::size_t kChecksum = 4;

MemberConfig member(RobotId id, const char* pattern) {
  MemberConfig member;
  member.id = id;
  member.name = "r" + std::to_string(id.value);
  member.pattern = pattern;
  member.p_body_led = {0.05, 0.0, 0.01};
  member.p_body_uwb = {-0.04, 0.02, 0.1};
  return member;
}

EstimatorSettings settings() {
  Config config;
  config.robot.id = kOne;
  config.swarm.members = {member(kOne, "011111111111111111"), member(kTwo, "001001011111111111")};
  return estimator_settings(config);
}

const RobotKey& key_of_two() {
  static const RobotKey kKey = robot_key_of(std::array<std::uint8_t, 32>{2});
  return kKey;
}

/// The bytes of the input, zeros after its end.
class Input {
 public:
  explicit Input(std::span<const std::uint8_t> data) : data_(data) {}
  [[nodiscard]] bool is_empty() const { return at_ >= data_.size(); }
  std::uint8_t next() { return is_empty() ? std::uint8_t{0} : data_[at_++]; }

 private:
  std::span<const std::uint8_t> data_;
  std::size_t at_ = 0;
};

void change_contents(FuzzInput& plain, Input& input) {
  constexpr int kMost = 8;
  const std::size_t body = plain.size() - kHeader - kChecksum;
  for (int i = input.next() % kMost; i > 0; --i) {
    const std::size_t place = input.next() + 256U * input.next();
    plain[kHeader + place % body] ^= input.next();
  }
  const std::size_t end = plain.size() - kChecksum;
  const std::uint32_t sum = crc32(std::span(plain).first(end));
  for (std::size_t i = 0; i < kChecksum; ++i)
    plain[end + i] = static_cast<std::uint8_t>(sum >> 8U * i);
}

class Conversation {
 public:
  Conversation() {
    MeshTrust trust;
    trust.keys.emplace(kTwo, public_key_of(key_of_two()));
    one_.set_trust(trust);
    own_.sender = kOne;
    own_.stamp = now_;
    own_.tilt = {now_, Eigen::Vector3d::UnitZ(), 0.01};
  }

  void step(Input& input) {
    now_ += milliseconds{40};
    for (int i = 3; i >= 0; --i) {
      const Timestamp t = now_ - milliseconds{10} * i;
      handle(ImuSample{t, wobble(t), {0.0, 0.0, 9.81}});
    }
    handle(Tick{now_});
    (void)two_.receive(one_.compose(own_, now_, seal_), now_, seal_);
    FuzzInput plain = two_.compose(report_of_two(), now_);
    change_contents(plain, input);
    const auto sealed = seal_->seal(signer_.sign(plain));
    if (auto received = one_.receive(sealed, now_, seal_)) handle(std::move(*received));
  }

 private:
  static Eigen::Vector3d wobble(Timestamp t) {
    return {0.01 * std::sin(static_cast<double>(to_ns(t) % 1000003)), 0.002, 0.001};
  }

  void handle(Event event) {
    const Outputs outputs = estimator_.step(event);
    for (const NeighborPose& pose : outputs.poses) {
      CREPES_EXPECT(pose.T_B_N.pose.p.allFinite() && pose.T_B_N.covariance.allFinite(),
                    "poses are finite");
    }
    if (outputs.report) own_ = *outputs.report;
  }

  [[nodiscard]] Report report_of_two() const {
    Report report;
    report.sender = kTwo;
    report.stamp = now_;
    report.tilt = {now_, Eigen::Vector3d::UnitZ(), 0.01};
    for (int i = 3; i >= 0; --i) {
      const Timestamp t = now_ - milliseconds{10} * i;
      report.imu.push_back({t, -wobble(t), {0.0, 0.0, 9.81}});
    }
    report.bearings.push_back({now_, kOne, -Eigen::Vector3d::UnitX(), {0.06, 0.0, 0.04}, 0.001});
    report.ranges.push_back({now_, kOne, 4.27, -85.0, -80.0});
    NeighborEstimate estimate;
    estimate.neighbor = kOne;
    estimate.stamp = now_;
    estimate.T_B_N.pose.p.x() = -4.2;
    estimate.T_B_N.covariance = 0.01 * Matrix6d::Identity();
    report.estimates.push_back(estimate);
    return report;
  }

  Timestamp now_{std::chrono::seconds{100}};
  std::optional<PacketSeal> seal_{PacketSeal(MeshKey{{7}})};
  PacketSigner signer_{key_of_two()};
  PeerLink one_{kOne, {kOne, kTwo}};
  PeerLink two_{kTwo, {kOne, kTwo}};
  Estimator estimator_{settings()};
  Report own_;  ///< the newest
};

}  // namespace

void run_mesh(std::span<const std::uint8_t> data) {
  constexpr int kBefore = 8;  // until the clocks know each other
  constexpr int kMost = 60;
  Conversation conversation;
  Input nothing({});
  for (int i = 0; i < kBefore; ++i) conversation.step(nothing);
  Input input(data);
  for (int i = 0; i < kMost && !input.is_empty(); ++i) conversation.step(input);
  for (int i = 0; i < kBefore; ++i) conversation.step(nothing);
}

std::vector<FuzzInput> mesh_seeds() {
  FuzzInput quiet(20);
  FuzzInput busy;
  for (std::uint8_t i = 0; i < 60; ++i)
    busy.insert(busy.end(), {2, i, 0, 0x40, static_cast<std::uint8_t>(7 * i), 0, 0xff});
  return {quiet, busy};
}

}  // namespace crepes
