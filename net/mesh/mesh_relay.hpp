/// Which datagrams are forwarded to robots that do not hear their sender. Pure.
///
/// A robot needs forwarding if one of its neighbors hears a robot that it does not hear itself. It
/// then marks one datagram in a few; a marked one repeats the contents since the last mark. Only
/// marked datagrams are forwarded. A robot forwards one once, if one of its neighbors hears neither
/// the sender nor any robot that has already forwarded it (Peng, Lu 2000). It first waits for a
/// random time, which is shorter the more robots it would reach. Datagrams without the mark are
/// never forwarded, so their sender is heard directly.
///
/// The source address identifies the forwarder. A forged address can suppress forwarding, which
/// jamming could do as well.
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

/// Identifies a datagram.
struct DatagramId {
  RobotId sender{};
  std::uint64_t session = 0;
  std::uint32_t sequence = 0;
  [[nodiscard]] bool operator==(const DatagramId&) const = default;
};

/// One datagram in this many is marked, if one is sent for every `reports` reports: about four
/// marked ones a second, and at most every second one.
[[nodiscard]] std::uint32_t mark_spacing(std::size_t reports);

class MeshRelay {
 public:
  explicit MeshRelay(RobotId self) : self_(self) {}

  /// The time between datagrams of this robot, and roughly of the others. A silent robot counts as
  /// out of reach after a multiple of it.
  void set_period(Duration period) { period_ = period; }

  /// A datagram without the mark arrived: its sender is heard directly.
  void record_heard(RobotId sender, const Endpoint& from, Timestamp at) {
    neighbors_[sender].heard = at;
    neighbors_[sender].address = from;
  }
  /// The neighbor says that it hears `other` directly.
  void record_hears(RobotId neighbor, RobotId other, Timestamp at) {
    neighbors_[neighbor].hears[other] = at;
  }

  /// Whether datagrams of this robot arrive directly.
  [[nodiscard]] bool is_heard(RobotId sender, Timestamp now) const;
  /// Whether a robot that was heard directly has this address.
  [[nodiscard]] bool is_neighbor(const Endpoint& address) const;
  /// Whether this robot should mark datagrams.
  [[nodiscard]] bool is_needed(Timestamp now) const;

  /// Considers a new and authentic marked datagram for forwarding. `from` is its source address:
  /// the sender's or the forwarder's.
  void offer(const DatagramId& id, std::span<const std::uint8_t> bytes, const Endpoint& from,
             Timestamp now);
  /// A datagram arrived again. True if it is one that was offered.
  bool record_copy(const DatagramId& id, const Endpoint& from);
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
  void record_sent(Offer& offer, const Endpoint& from) const;

  [[nodiscard]] bool is_in_reach(const Neighbor& neighbor, Timestamp now) const;
  [[nodiscard]] bool is_believed(Timestamp said, Timestamp now) const;

  RobotId self_;
  Duration period_ = std::chrono::milliseconds{40};
  std::map<RobotId, Neighbor> neighbors_;
  std::deque<Offer> offers_;  ///< of the last second
};

}  // namespace crepes
