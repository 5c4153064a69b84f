/// Which datagrams are forwarded to robots that do not hear their sender. Pure.
///
/// A robot depends on others when a robot that it hears hears one that it does not hear. Then it
/// marks one datagram in a few, which carries more than the rest. Only these are forwarded: once,
/// by robots that hear one that hears neither the sender nor anybody who has forwarded it until
/// then (Peng, Lu 2000). They wait for a random time, the shorter the more robots they would reach.
/// A datagram without the mark is never forwarded, so who sends one is heard directly.
///
/// Who forwarded a datagram is known by its address. To forge it keeps others from forwarding, as
/// noise on the air would.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "estimator/core/measurements.hpp"
#include "estimator/core/time.hpp"
#include "estimator/core/token_bucket.hpp"
#include "net/endpoint.hpp"

namespace crepes {

/// What tells a datagram from all others.
struct DatagramId {
  RobotId sender{};
  std::uint64_t session = 0;
  std::uint32_t sequence = 0;
  [[nodiscard]] bool operator==(const DatagramId&) const = default;
};

/// Datagrams of the session for each that is marked, where one is sent for each `reports` reports:
/// about four marked ones a second, and at most every second one.
[[nodiscard]] std::uint32_t mark_spacing(std::size_t reports);

class MeshRelay {
 public:
  explicit MeshRelay(RobotId self) : self_(self) {}

  /// Between datagrams, of this robot and, more or less, of the others. The longer it is, the later
  /// a silent robot is out of reach.
  void set_period(Duration period) { period_ = period; }

  /// A datagram without the mark arrived: its sender is heard directly.
  void note_heard(RobotId sender, const Endpoint& from, Timestamp at) {
    neighbors_[sender].heard = at;
    neighbors_[sender].address = from;
  }
  /// The neighbor says that it hears `other` directly.
  void note_hears(RobotId neighbor, RobotId other, Timestamp at) {
    neighbors_[neighbor].hears[other] = at;
  }

  [[nodiscard]] bool is_heard(RobotId sender, Timestamp now) const;
  /// Whether a robot that was heard directly has this address.
  [[nodiscard]] bool is_neighbor(const Endpoint& address) const;
  /// Whether this robot should mark datagrams.
  [[nodiscard]] bool is_needed(Timestamp now) const;

  /// A marked datagram, new and authentic. `from` is its source, the sender or who forwarded it.
  void offer(const DatagramId& id, std::span<const std::uint8_t> bytes, const Endpoint& from,
             Timestamp now);
  /// A datagram arrived again. True if it is one that was offered.
  bool note_copy(const DatagramId& id, const Endpoint& from);
  /// When `take_due` should be called next; empty if nothing waits.
  [[nodiscard]] std::optional<Timestamp> next_due() const;
  /// What to broadcast now, the newest first.
  [[nodiscard]] std::vector<std::vector<std::uint8_t>> take_due(Timestamp now);

 private:
  struct Neighbor {
    Timestamp heard{Duration::min()};
    Endpoint address;
    std::map<RobotId, Timestamp> hears;
    TokenBucket forwards{{.per_s = 8, .burst = 8}};  ///< what is forwarded of it
  };
  struct Offer {
    DatagramId id;
    Timestamp at{};
    Timestamp due{};
    std::vector<RobotId> sent_by;     ///< the sender, and who forwarded it
    std::vector<std::uint8_t> bytes;  ///< empty when it was decided
  };

  /// Robots that are heard and hear none of these.
  [[nodiscard]] std::size_t missed_by(const std::vector<RobotId>& sent_by, Timestamp now) const;
  void note_sent(Offer& offer, const Endpoint& from) const;

  [[nodiscard]] bool is_in_reach(const Neighbor& neighbor, Timestamp now) const;
  [[nodiscard]] bool is_believed(Timestamp said, Timestamp now) const;

  RobotId self_;
  Duration period_ = std::chrono::milliseconds{40};
  std::map<RobotId, Neighbor> neighbors_;
  std::deque<Offer> offers_;  ///< of the last second
};

}  // namespace crepes
