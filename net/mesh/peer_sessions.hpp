/// The sessions of all peers: which datagrams are new, which session of a peer is the live one, and
/// what is known of its clock, its loss and its neighbors.
///
/// A peer that restarts opens a new session. The new session replaces the old one when it has
/// echoed a recent datagram of ours and the old one is silent. Recorded datagrams that are replayed
/// cannot do the former, and a second robot with the peer's id does not displace the first. A
/// session that was replaced returns if it echoes what we sent after that, and the other one is
/// silent.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "net/endpoint.hpp"
#include "net/mesh/clock_offset.hpp"
#include "net/mesh/loss_meter.hpp"
#include "net/mesh/mesh_counters.hpp"
#include "net/mesh/mesh_relay.hpp"
#include "net/mesh/peer_message.hpp"
#include "net/mesh/peer_status.hpp"
#include "net/mesh/redundancy_filter.hpp"
#include "net/mesh/sent_log.hpp"
#include "net/mesh/sequence_window.hpp"

namespace crepes {

class PeerSessions {
 public:
  /// A run of a peer's program, from its start on.
  struct Session {
    std::uint64_t id = 0;
    LossMeter loss;                        ///< of the peer's datagrams, at us
    std::optional<double> loss_of_ours{};  ///< at the peer
    ClockOffset clock;
    SequenceWindow sequence;
    RedundancyFilter redundancy;
    PeerTraffic traffic;  ///< includes the earlier sessions
    Timestamp first_arrival{};
    Timestamp last_arrival{};
    bool has_echoed_us = false;  ///< a recent datagram of ours
  };

  /// A message that is new, and what it belongs to.
  struct Accepted {
    Session* session;
    bool is_live;  ///< of the peer's live session
  };

  explicit PeerSessions(RobotId self) : self_(self), relay_(self) {}

  /// Removes peers that are no longer members; adds the new ones.
  void set_members(const std::vector<RobotId>& members);
  /// Whether it is a member, and not us.
  [[nodiscard]] bool knows(RobotId peer) const { return peers_.contains(peer); }

  /// A datagram of ours leaves.
  void record_sent(Timestamp at, std::uint32_t sequence, bool is_marked) {
    sent_.add(at, sequence, is_marked);
  }
  /// What we sent in the last seconds.
  [[nodiscard]] const SentLog& sent() const { return sent_; }

  /// The counter of a datagram that is not new, by its header alone; empty if it may be. Changes no
  /// session.
  [[nodiscard]] std::optional<MeshCounter> refusal_of(const PeerHeader& header, Timestamp arrival,
                                                      const Endpoint& from);
  /// The session of a known peer's message, if the message is new in it and its stamps agree with
  /// it. Counts why not. A session that has echoed us becomes the live one if the former is silent.
  [[nodiscard]] std::optional<Accepted> accept(const PeerMessage& message, Timestamp arrival,
                                               const Endpoint& from);
  /// A second robot uses this id.
  void count_doubled(MeshCounter counter, RobotId robot, Timestamp now);

  /// Peers that are heard directly, and new ones.
  [[nodiscard]] std::size_t heard_directly(Timestamp now) const;
  /// Of the peer that loses the most of ours, among those that hear us directly.
  [[nodiscard]] double worst_loss_of_ours(Timestamp now) const;
  /// What each peer learns of its datagrams, ordered by peer.
  [[nodiscard]] std::vector<ClockEcho> echoes(Timestamp now) const;

  /// Peers whose clock is known, ordered by id.
  [[nodiscard]] std::vector<ClockStatus> clocks() const;
  /// All peers that a datagram was received from, ordered by id.
  [[nodiscard]] std::vector<PeerTraffic> traffic(Timestamp now) const;
  /// The latest datagram of a second robot that uses our id or a peer's.
  [[nodiscard]] const std::optional<DoubledId>& doubled_id() const { return doubled_; }

  /// Datagrams and refusals; what sending and opening counts is added by the owner.
  [[nodiscard]] MeshCounters& counters() { return counters_; }
  /// The same, to read.
  [[nodiscard]] const MeshCounters& counters() const { return counters_; }
  /// Who hears whom, and what is to be forwarded.
  [[nodiscard]] MeshRelay& relay() { return relay_; }
  /// The same, to read.
  [[nodiscard]] const MeshRelay& relay() const { return relay_; }

 private:
  struct EndedSession {
    std::uint64_t id = 0;
    Timestamp at{};
  };
  struct Peer {
    std::optional<Session> live;
    std::optional<Session> candidate;  ///< has not echoed us yet
    std::deque<EndedSession> ended;    ///< the latest that were live
    [[nodiscard]] const std::optional<Session>& heard() const { return live ? live : candidate; }
  };

  [[nodiscard]] Session* accepted_by(Peer& peer, const PeerMessage& message, Timestamp arrival,
                                     const Endpoint& from);
  [[nodiscard]] Session* admit(Peer& peer, const PeerMessage& message, Timestamp arrival,
                               const Endpoint& from);
  [[nodiscard]] bool readmit(Peer& peer, const PeerMessage& message, Timestamp arrival);
  [[nodiscard]] bool update_clock(Session& session, const PeerMessage& message, Timestamp arrival);
  static void replace_session(Peer& peer, Timestamp now);
  void update_loss(Session& session, const PeerMessage& message, Timestamp arrival) const;
  void record_reachability(const PeerMessage& message, Timestamp arrival, const Endpoint& from);
  [[nodiscard]] MeshCounter counted_copy(MeshCounter refusal, const DatagramId& id,
                                         const Endpoint& from);

  RobotId self_;
  std::map<RobotId, Peer> peers_;  ///< all members except us
  MeshRelay relay_;
  SentLog sent_;
  MeshCounters counters_;
  std::optional<DoubledId> doubled_;
};

}  // namespace crepes
