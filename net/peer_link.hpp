/// The mesh as values: datagrams in, reports on our timeline out. No sockets, no clocks.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "estimator/core/outputs.hpp"
#include "net/clock_offset.hpp"
#include "net/peer_message.hpp"
#include "net/redundancy_filter.hpp"
#include "net/sequence_window.hpp"

namespace crepes {

class PeerLink {
 public:
  /// `members` are all robots of the swarm; `self` may be among them.
  PeerLink(RobotId self, const std::vector<RobotId>& members);

  /// Forgets who is no member any more; new ones are peers from now on.
  void set_members(const std::vector<RobotId>& members);

  /// A peer's report, each measurement once however often it was sent. Empty when there is nothing
  /// to tell: refused (see counters), our own echo, or the peer's clock is not yet known.
  [[nodiscard]] std::optional<ReceivedReport> receive(std::span<const std::uint8_t> datagram,
                                                      Timestamp arrival);

  /// The datagram to broadcast at once; `now` is when it leaves.
  [[nodiscard]] std::vector<std::uint8_t> compose(const Report& report, Timestamp now);

  /// Peers whose clock is known, ordered by id.
  [[nodiscard]] std::vector<ClockStatus> clocks() const;
  /// All peers that were ever heard, ordered by id.
  [[nodiscard]] std::vector<PeerTraffic> traffic(Timestamp now) const;
  /// Totals by name: bytes and datagrams in and out, refusals by reason.
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() const;

 private:
  struct Peer {
    std::uint32_t session = 0;
    std::uint32_t previous_session = 0;
    ClockOffset clock;
    SequenceWindow sequence;
    RedundancyFilter redundancy;
    PeerTraffic traffic;
    Timestamp last_arrival{};
  };

  [[nodiscard]] Peer* admit(const PeerMessage& message);
  [[nodiscard]] bool tell_clock(Peer& peer, const PeerMessage& message, Timestamp arrival);
  [[nodiscard]] std::uint32_t session() const;
  void count(std::string_view what, std::uint64_t by = 1);

  RobotId self_;
  std::map<RobotId, std::optional<Peer>> peers_;  ///< all members but us; empty until heard
  std::map<std::string, std::uint64_t, std::less<>> counters_;
  std::optional<Timestamp> first_sent_;
  std::uint32_t next_sequence_ = 0;
};

}  // namespace crepes
