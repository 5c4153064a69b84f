/// The mesh as values: datagrams in, reports on our timeline out. No sockets, no clocks.
///
/// A peer that starts anew has a new session. It takes the place of the one before when it has
/// echoed a datagram of ours: what somebody recorded and plays again cannot.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "estimator/core/outputs.hpp"
#include "net/clock_offset.hpp"
#include "net/packet_seal.hpp"
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
  /// to tell: refused (see counters), our own echo, or the peer's clock is not yet known. Where
  /// there is a seal, datagrams without it are refused; where there is none, those with one.
  [[nodiscard]] std::optional<ReceivedReport> receive(
      std::span<const std::uint8_t> datagram, Timestamp arrival,
      const std::optional<PacketSeal>& seal = std::nullopt);

  /// The datagram to broadcast at once; `now` is when it leaves.
  [[nodiscard]] std::vector<std::uint8_t> compose(
      const Report& report, Timestamp now, const std::optional<PacketSeal>& seal = std::nullopt);

  /// Peers whose clock is known, ordered by id.
  [[nodiscard]] std::vector<ClockStatus> clocks() const;
  /// All peers that were ever heard, ordered by id.
  [[nodiscard]] std::vector<PeerTraffic> traffic(Timestamp now) const;
  /// Totals by name: bytes and datagrams in and out, refusals by reason.
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() const;

 private:
  struct Session {
    std::uint32_t id = 0;
    ClockOffset clock;
    SequenceWindow sequence;
    RedundancyFilter redundancy;
    PeerTraffic traffic;  ///< of the sessions before, too
    Timestamp last_arrival{};
    bool hears_us = false;  ///< has echoed a datagram of ours
  };
  struct Peer {
    std::optional<Session> live;
    std::optional<Session> newcomer;  ///< has not echoed us yet
    std::set<std::uint32_t> ended;    ///< sessions that were live
    [[nodiscard]] const std::optional<Session>& heard() const { return live ? live : newcomer; }
  };

  [[nodiscard]] std::optional<PeerMessage> open(std::span<const std::uint8_t> datagram,
                                                const std::optional<PacketSeal>& seal);
  [[nodiscard]] Session* admit(Peer& peer, const PeerMessage& message);
  [[nodiscard]] bool tell_clock(Session& session, const PeerMessage& message, Timestamp arrival);
  static void succeed(Peer& peer);
  [[nodiscard]] bool is_own_datagram(Timestamp sent, Timestamp now) const;
  [[nodiscard]] std::uint32_t session() const;
  void count(std::string_view what, std::uint64_t by = 1);

  RobotId self_;
  std::map<RobotId, Peer> peers_;  ///< all members but us
  std::map<std::string, std::uint64_t, std::less<>> counters_;
  std::optional<Timestamp> first_sent_;
  std::deque<Timestamp> sent_;  ///< of the last seconds: what a peer may echo
  std::uint32_t next_sequence_ = 0;
};

}  // namespace crepes
