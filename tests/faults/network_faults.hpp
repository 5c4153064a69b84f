/// Faults of the network and of what a robot reports.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "daemon/ctl/replay/swarm_replay.hpp"
#include "net/mesh/packet_seal.hpp"
#include "tests/faults/dice.hpp"
#include "tests/faults/fault.hpp"

namespace crepes::faults {

/// Changes the deliveries of every datagram by the faults that last when it is sent.
class FaultyNetwork {
 public:
  using Bytes = std::vector<std::uint8_t>;

  /// `sealed`: the datagrams are, with the keys of the replay.
  explicit FaultyNetwork(bool sealed) {
    if (sealed) seal_.emplace(replay_swarm_key());
  }
  void strike(const std::vector<Fault>& faults);

  void operator()(RobotId from, RobotId to, double sent_s, std::vector<Delivery>& deliveries);

 private:
  void apply(const Fault& fault, RobotId from, RobotId to, double sent_s,
             std::vector<Delivery>& deliveries);
  void flood(const Fault& fault, double sent_s, std::vector<Delivery>& deliveries);
  void record(const Delivery& delivery, RobotId from, double sent_s);
  void replay(const Fault& fault, RobotId from, double sent_s, std::vector<Delivery>& deliveries);
  void damage(Bytes& bytes);
  [[nodiscard]] Bytes of_second_robot(const Bytes& bytes, RobotId from) const;

  std::vector<Fault> faults_;
  Dice dice_{0};
  std::optional<PacketSeal> seal_;
  std::map<RobotId, std::deque<Bytes>> recorded_;  ///< by sender: the latest
  std::map<RobotId, std::deque<Bytes>> ended_;     ///< of sessions that have ended since
};

/// What lying robots change in the reports that they send at `true_s`.
class Liars {
 public:
  explicit Liars(const std::vector<Fault>& faults);
  void operator()(double true_s, Report& report);

 private:
  struct Liar {
    Fault fault;
    Dice dice;
  };
  std::vector<Liar> liars_;
};

}  // namespace crepes::faults
