/// The mesh of a replay: datagrams are delayed, reordered and lost.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "daemon/ctl/dataset/swarm_manifest.hpp"
#include "estimator/core/measurements.hpp"

namespace crepes {

class SimulatedNetwork {
 public:
  /// With `burst_s`, a link loses everything for so long, then nothing for a time with an
  /// exponential distribution, so that the share that is lost is the model's (Gilbert 1960).
  SimulatedNetwork(const NetworkModel& model, std::uint64_t seed, double burst_s = 0.0)
      : model_(model), burst_s_(burst_s), random_(seed) {}

  /// The delay of one datagram to one receiver [s]; empty if it is lost.
  [[nodiscard]] std::optional<double> delay_s(RobotId from, RobotId to, double sent_s) {
    const bool lost =
        burst_s_ > 0 ? is_in_burst(bursts_[{from, to}], sent_s) : uniform() < model_.loss;
    const double delay_ms = model_.latency_ms + uniform() * model_.jitter_ms;
    return lost ? std::nullopt : std::optional(delay_ms * 1e-3);
  }

  /// The delays of one datagram to those that it reaches [s]. Robots that do not hear the sender
  /// get it from those that do, who forward it once, if `forwards`.
  [[nodiscard]] std::map<RobotId, double> delays_s(
      RobotId from, const std::vector<RobotId>& robots, double sent_s, bool forwards,
      const std::function<bool(RobotId, RobotId)>& hears) {
    std::map<RobotId, double> reached{{from, 0.0}};
    std::vector<RobotId> due{from};
    while (!due.empty()) {
      const auto earlier = [&](RobotId a, RobotId b) { return reached.at(a) < reached.at(b); };
      const auto next = std::ranges::min_element(due, earlier);
      const RobotId hop = *next;
      due.erase(next);
      for (const RobotId to : robots) {
        if (to == hop || to == from || (hop != from && hears(to, from)) || !hears(to, hop))
          continue;
        const auto delay = delay_s(hop, to, sent_s);
        if (!delay) continue;
        const auto [known, is_new] = reached.try_emplace(to, reached.at(hop) + *delay);
        known->second = std::min(known->second, reached.at(hop) + *delay);
        if (is_new && forwards) due.push_back(to);
      }
    }
    reached.erase(from);
    return reached;
  }

 private:
  struct Burst {
    double from_s = 0.0;
    double to_s = 0.0;
  };

  [[nodiscard]] bool is_in_burst(Burst& burst, double sent_s) {
    if (model_.loss <= 0) return false;
    const double mean_gap_s = burst_s_ * (1 - model_.loss) / model_.loss;
    while (burst.to_s <= sent_s) {
      burst.from_s = burst.to_s - mean_gap_s * std::log(1 - uniform());
      burst.to_s = burst.from_s + burst_s_;
    }
    return sent_s >= burst.from_s;
  }

  // In [0, 1). Unlike the distributions of std, it gives the same values everywhere.
  double uniform() { return static_cast<double>(random_() >> 11U) * 0x1.0p-53; }

  NetworkModel model_;
  double burst_s_;
  std::map<std::pair<RobotId, RobotId>, Burst> bursts_;  ///< by sender and receiver
  std::mt19937_64 random_;
};

}  // namespace crepes
