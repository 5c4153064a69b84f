/// What a datagram of 400 bytes between robots costs, signature and seal included.
#include <benchmark/benchmark.h>

#include <array>
#include <chrono>
#include <optional>
#include <vector>

#include "net/mesh/packet_seal.hpp"
#include "net/mesh/packet_signature.hpp"
#include "net/mesh/peer_link.hpp"
#include "net/mesh/peer_message.hpp"

namespace crepes {
namespace {

OutgoingPeerMessage full_message() {
  OutgoingPeerMessage message;
  Report& report = message.report;
  report.sender = RobotId{1};
  report.tilt = {report.stamp, Eigen::Vector3d::UnitZ(), 0.01};
  const auto ago = [&](int ms) { return report.stamp - std::chrono::milliseconds{ms}; };
  for (int i = 0; i < 16; ++i)
    report.imu.push_back({ago(10 * i), {0.1 * i, 0.2, -0.3}, {0.1, 0.2 * i, 9.8}});
  for (std::uint16_t id = 2; id < 6; ++id) {
    const RobotId neighbor{id};
    report.estimates.push_back({ago(5), neighbor, {{}, Matrix6d::Identity() * 1e-4}, {}});
    for (int i = 0; i < 40; ++i) {
      report.bearings.push_back(
          {ago(5 * i), neighbor, Eigen::Vector3d::UnitX(), Eigen::Vector3d::Zero(), 1e-3});
      report.ranges.push_back({ago(5 * i), neighbor, 4.0, -80.0, -79.0});
    }
  }
  return message;
}

const PacketSeal& swarm_seal() {
  static const PacketSeal seal(MeshKey{1, 2, 3});
  return seal;
}

RobotKey key_of(std::uint8_t robot) {
  const std::array<std::uint8_t, 32> seed{robot};
  return robot_key_of(seed);
}

const PacketSigner& signer() {
  static const PacketSigner own(key_of(1));
  return own;
}

// In a swarm of five, and 33 % of the datagrams are lost.
constexpr WireLimits kLimits{.bytes = kMinPeerMessage, .copies = 6};

std::vector<std::uint8_t> plain() { return encode_peer_message(full_message(), kLimits).bytes; }

void BM_Encode(benchmark::State& state) {
  const OutgoingPeerMessage message = full_message();
  for (auto _ : state) benchmark::DoNotOptimize(encode_peer_message(message, kLimits));
}
BENCHMARK(BM_Encode);

void BM_Decode(benchmark::State& state) {
  const auto bytes = plain();
  for (auto _ : state) benchmark::DoNotOptimize(decode_peer_message(bytes));
}
BENCHMARK(BM_Decode);

void BM_Sign(benchmark::State& state) {
  const auto bytes = plain();
  for (auto _ : state) benchmark::DoNotOptimize(signer().sign(bytes));
}
BENCHMARK(BM_Sign);

void BM_Verify(benchmark::State& state) {
  const auto bytes = signer().sign(plain());
  const PublicKey key = public_key_of(key_of(1));
  for (auto _ : state) benchmark::DoNotOptimize(is_authentic(bytes, key));
}
BENCHMARK(BM_Verify);

void BM_Seal(benchmark::State& state) {
  const auto bytes = signer().sign(plain());
  for (auto _ : state) benchmark::DoNotOptimize(swarm_seal().seal(bytes));
}
BENCHMARK(BM_Seal);

void BM_Open(benchmark::State& state) {
  const auto sealed = swarm_seal().seal(signer().sign(plain()));
  for (auto _ : state) benchmark::DoNotOptimize(swarm_seal().open(sealed));
}
BENCHMARK(BM_Open);

/// A stranger's: what a flood costs without the swarm's key.
void BM_RefuseSeal(benchmark::State& state) {
  const PacketSeal stranger(MeshKey{3, 2, 1});
  const auto sealed = stranger.seal(signer().sign(plain()));
  for (auto _ : state) benchmark::DoNotOptimize(swarm_seal().open(sealed));
}
BENCHMARK(BM_RefuseSeal);

/// An insider's, in another robot's name: what a flood costs with the swarm's key.
void BM_RefuseSignature(benchmark::State& state) {
  const std::vector<RobotId> members{RobotId{1}, RobotId{2}};
  PeerLink link(RobotId{2}, members);
  link.set_trust({.keys = {{RobotId{1}, public_key_of(key_of(1))}}, .excluded = {}});
  const PacketSigner insider(key_of(9));
  const auto sealed = swarm_seal().seal(insider.sign(plain()));
  const std::optional<PacketSeal> seal = swarm_seal();
  Timestamp now{};
  for (auto _ : state)  // a hundred thousand a second
    benchmark::DoNotOptimize(link.receive(sealed, now += std::chrono::microseconds{10}, seal));
}
BENCHMARK(BM_RefuseSignature);

}  // namespace
}  // namespace crepes
