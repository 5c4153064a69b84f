/// The mesh of a replay: datagrams are delayed, reordered and lost.
#pragma once

#include <cstdint>
#include <optional>
#include <random>

#include "daemon/ctl/dataset/swarm_manifest.hpp"

namespace crepes {

class SimulatedNetwork {
 public:
  SimulatedNetwork(const NetworkModel& model, std::uint64_t seed) : model_(model), random_(seed) {}

  /// The delay of one datagram to one receiver [s]; empty if it is lost.
  [[nodiscard]] std::optional<double> delay_s() {
    const bool lost = uniform() < model_.loss;
    const double delay_ms = model_.latency_ms + uniform() * model_.jitter_ms;
    return lost ? std::nullopt : std::optional(delay_ms * 1e-3);
  }

 private:
  // In [0, 1). Unlike the distributions of std, it gives the same values everywhere.
  double uniform() { return static_cast<double>(random_() >> 11U) * 0x1.0p-53; }

  NetworkModel model_;
  std::mt19937_64 random_;
};

}  // namespace crepes
