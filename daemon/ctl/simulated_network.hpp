/// The mesh of a replay: datagrams take their time, overtake each other, and get lost.
#pragma once

#include <cstdint>
#include <optional>
#include <random>

#include "daemon/ctl/swarm_manifest.hpp"

namespace crepes {

class SimulatedNetwork {
 public:
  SimulatedNetwork(const NetworkModel& model, std::uint64_t seed) : model_(model), random_(seed) {}

  /// How long one datagram takes to one receiver [s]; empty if it is lost.
  [[nodiscard]] std::optional<double> delay_s() {
    const bool lost = uniform() < model_.loss;
    const double delay_ms = model_.latency_ms + uniform() * model_.jitter_ms;
    return lost ? std::nullopt : std::optional(delay_ms * 1e-3);
  }

 private:
  // In [0, 1), by its definition the same everywhere: std's distributions are not.
  double uniform() { return static_cast<double>(random_() >> 11U) * 0x1.0p-53; }

  NetworkModel model_;
  std::mt19937_64 random_;
};

}  // namespace crepes
