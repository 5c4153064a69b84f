/// The protocol of the mesh without its socket: datagrams in, reports on our timeline out.
///
/// A peer that restarts opens a new session. The new session replaces the old one when it has
/// echoed a recent datagram of ours and the old one is silent. Recorded datagrams that are replayed
/// cannot do the former, and a second robot with the peer's id does not displace the first. A
/// session that was replaced returns if it echoes what we sent after that, and the other one is
/// silent.
///
/// Some datagrams are marked: they are forwarded to robots that do not hear their sender
/// (`mesh_relay.hpp`), as they came, and are the only ones that these robots have of it.
///
/// What a member with a key sends must be signed. A signature is verified last, when the seal, the
/// sender and the sequence number are right, and nothing that it protects is used before.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "estimator/core/outputs.hpp"
#include "net/endpoint.hpp"
#include "net/mesh/clock_offset.hpp"
#include "net/mesh/loss_meter.hpp"
#include "net/mesh/mesh_counters.hpp"
#include "net/mesh/mesh_relay.hpp"
#include "net/mesh/mesh_trust.hpp"
#include "net/mesh/packet_seal.hpp"
#include "net/mesh/packet_signature.hpp"
#include "net/mesh/peer_message.hpp"
#include "net/mesh/peer_status.hpp"
#include "net/mesh/redundancy_filter.hpp"
#include "net/mesh/send_pacing.hpp"
#include "net/mesh/sequence_window.hpp"
#include "net/mesh/signature_limiter.hpp"

namespace crepes {

class PeerLink {
 public:
  /// `members` are all robots of the swarm; `self` may be among them.
  PeerLink(RobotId self, const std::vector<RobotId>& members, const SendSettings& settings = {});

  /// Removes peers that are no longer members; adds the new ones.
  void set_members(const std::vector<RobotId>& members);
  /// From now on. Sessions remain.
  void set_trust(const MeshTrust& trust) { trust_ = trust; }
  /// The session remains.
  void set_pacing(const SendSettings& settings);

  /// The report of a peer. Measurements that it repeats are returned once. Empty when the datagram
  /// is refused (see `counters`), is our own, or the peer's clock is not known yet. With `seal`,
  /// unsealed datagrams are refused; without it, sealed ones are. `from` is the datagram's source.
  [[nodiscard]] std::optional<ReceivedReport> receive(
      std::span<const std::uint8_t> datagram, Timestamp arrival,
      const std::optional<PacketSeal>& seal = std::nullopt, const Endpoint& from = {});

  /// Whether a datagram is due. Where airtime is short, the contents of a report wait for the next
  /// datagram.
  [[nodiscard]] bool is_due(Timestamp now) const;
  /// The datagram to broadcast immediately; `now` is the time of sending.
  [[nodiscard]] std::vector<std::uint8_t> compose(
      const Report& report, Timestamp now, const std::optional<PacketSeal>& seal = std::nullopt,
      const std::optional<PacketSigner>& signer = std::nullopt);
  /// Datagrams of others to broadcast immediately, as they came.
  [[nodiscard]] std::vector<std::vector<std::uint8_t>> forwards(Timestamp now);
  /// When to call `forwards`; empty if nothing waits.
  [[nodiscard]] std::optional<Timestamp> next_forward() const { return relay_.next_due(); }

  /// Peers whose clock is known, ordered by id.
  [[nodiscard]] std::vector<ClockStatus> clocks() const;
  /// All peers that a datagram was received from, ordered by id.
  [[nodiscard]] std::vector<PeerTraffic> traffic(Timestamp now) const;
  /// The latest datagram of a second robot that uses our id or a peer's.
  [[nodiscard]] const std::optional<DoubledId>& doubled_id() const { return doubled_; }
  /// Since the start: datagrams and bytes in and out, refusals by reason.
  [[nodiscard]] const MeshCounters& counters() const { return counters_; }

 private:
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

  [[nodiscard]] std::optional<PeerMessage> open(std::span<const std::uint8_t> datagram,
                                                Timestamp arrival,
                                                const std::optional<PacketSeal>& seal,
                                                const Endpoint& from);
  [[nodiscard]] tl::expected<PeerMessage, MeshCounter> read(std::span<const std::uint8_t> plain,
                                                            Timestamp arrival,
                                                            const Endpoint& from);
  [[nodiscard]] std::optional<MeshCounter> refusal_of(RobotId sender) const;
  [[nodiscard]] std::optional<MeshCounter> refusal_of(std::span<const std::uint8_t> plain,
                                                      const PeerHeader& header, Timestamp arrival,
                                                      const Endpoint& from);
  [[nodiscard]] bool is_our_own(const PeerHeader& header) const;
  [[nodiscard]] Session* accept(Peer& peer, const PeerMessage& message, Timestamp arrival,
                                const Endpoint& from);
  [[nodiscard]] Session* admit(Peer& peer, const PeerMessage& message, Timestamp arrival,
                               const Endpoint& from);
  [[nodiscard]] bool readmit(Peer& peer, const PeerMessage& message, Timestamp arrival);
  [[nodiscard]] bool update_clock(Session& session, const PeerMessage& message, Timestamp arrival);
  void count_doubled(MeshCounter counter, RobotId robot, Timestamp now);
  static void replace_session(Peer& peer, Timestamp now);
  void update_loss(Session& session, const PeerMessage& message, Timestamp arrival) const;
  void record_reachability(const PeerMessage& message, Timestamp arrival, const Endpoint& from);
  [[nodiscard]] MeshCounter counted_copy(MeshCounter refusal, const DatagramId& id,
                                         const Endpoint& from);
  [[nodiscard]] std::optional<Timestamp> sent_by_us(std::uint32_t code, Timestamp now) const;
  [[nodiscard]] std::uint64_t own_session() const;
  [[nodiscard]] std::size_t heard_directly(Timestamp now) const;
  [[nodiscard]] Pace pace(Timestamp now) const;
  [[nodiscard]] double worst_loss_of_ours(Timestamp now, bool everywhere) const;
  [[nodiscard]] double forwarded_air(Timestamp now) const;
  [[nodiscard]] WireLimits limits(Timestamp now, std::size_t overhead, std::uint32_t mark) const;

  RobotId self_;
  SendSettings settings_;
  std::map<RobotId, Peer> peers_;  ///< all members except us
  MeshTrust trust_;
  SignatureLimiter limiter_;
  MeshRelay relay_;
  std::deque<std::pair<Timestamp, std::size_t>> forwarded_;  ///< bytes, in the last second
  MeshCounters counters_;
  std::optional<DoubledId> doubled_;
  std::optional<Timestamp> first_sent_;
  std::deque<Timestamp> sent_;  ///< in the last seconds: what a peer may echo
  std::uint32_t next_sequence_ = 0;
};

}  // namespace crepes
