/// What a full datagram between robots costs, and what its seal adds to that.
#include <benchmark/benchmark.h>

#include <chrono>

#include "net/mesh/packet_seal.hpp"
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

void BM_EncodeAndDecode(benchmark::State& state) {
  const OutgoingPeerMessage message = full_message();
  for (auto _ : state)
    benchmark::DoNotOptimize(decode_peer_message(encode_peer_message(message).bytes));
}
BENCHMARK(BM_EncodeAndDecode);

void BM_Seal(benchmark::State& state) {
  const auto plain = encode_peer_message(full_message()).bytes;
  for (auto _ : state) benchmark::DoNotOptimize(swarm_seal().seal(plain));
}
BENCHMARK(BM_Seal);

void BM_Open(benchmark::State& state) {
  const auto sealed = swarm_seal().seal(encode_peer_message(full_message()).bytes);
  for (auto _ : state) benchmark::DoNotOptimize(swarm_seal().open(sealed));
}
BENCHMARK(BM_Open);

/// A stranger's: what a flood costs at most.
void BM_Refuse(benchmark::State& state) {
  const PacketSeal stranger(MeshKey{3, 2, 1});
  const auto sealed = stranger.seal(encode_peer_message(full_message()).bytes);
  for (auto _ : state) benchmark::DoNotOptimize(swarm_seal().open(sealed));
}
BENCHMARK(BM_Refuse);

}  // namespace
}  // namespace crepes
