/// The protocol of the mesh without its socket: datagrams in, reports on our timeline out.
///
/// Some datagrams are marked: they are forwarded to robots that do not hear their sender
/// (`mesh_relay.hpp`), as they came, and are the only ones that these robots have of it.
///
/// What a member with a key sends must be signed. A signature is verified last, when the seal, the
/// sender and the sequence number are right, and nothing that it protects is used before.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "estimator/core/outputs.hpp"
#include "net/endpoint.hpp"
#include "net/mesh/mesh_counters.hpp"
#include "net/mesh/mesh_trust.hpp"
#include "net/mesh/packet_seal.hpp"
#include "net/mesh/packet_signature.hpp"
#include "net/mesh/peer_message.hpp"
#include "net/mesh/peer_sessions.hpp"
#include "net/mesh/peer_status.hpp"
#include "net/mesh/send_pacing.hpp"
#include "net/mesh/signature_limiter.hpp"

namespace crepes {

class PeerLink {
 public:
  /// `members` are all robots of the swarm; `self` may be among them.
  PeerLink(RobotId self, const std::vector<RobotId>& members, const SendSettings& settings = {});

  /// Removes peers that are no longer members; adds the new ones.
  void set_members(const std::vector<RobotId>& members) { sessions_.set_members(members); }
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
  [[nodiscard]] std::optional<Timestamp> next_forward() const {
    return sessions_.relay().next_due();
  }

  /// Peers whose clock is known, ordered by id.
  [[nodiscard]] std::vector<ClockStatus> clocks() const { return sessions_.clocks(); }
  /// All peers that a datagram was received from, ordered by id.
  [[nodiscard]] std::vector<PeerTraffic> traffic(Timestamp now) const {
    return sessions_.traffic(now);
  }
  /// What was on the air since the start.
  [[nodiscard]] AirTotals air_totals(Timestamp now) const;
  /// The latest datagram of a second robot that uses our id or a peer's.
  [[nodiscard]] const std::optional<DoubledId>& doubled_id() const {
    return sessions_.doubled_id();
  }
  /// Since the start: datagrams and bytes in and out, refusals by reason.
  [[nodiscard]] const MeshCounters& counters() const { return sessions_.counters(); }

 private:
  void count(MeshCounter counter, std::uint64_t n = 1) { sessions_.counters().add(counter, n); }
  [[nodiscard]] std::optional<PeerMessage> open(std::span<const std::uint8_t> datagram,
                                                Timestamp arrival,
                                                const std::optional<PacketSeal>& seal,
                                                const Endpoint& from);
  [[nodiscard]] tl::expected<PeerMessage, MeshCounter> read(std::span<const std::uint8_t> plain,
                                                            Timestamp arrival,
                                                            const Endpoint& from);
  void count_received(std::size_t bytes, std::optional<MeshCounter> refusal = std::nullopt);
  [[nodiscard]] std::optional<MeshCounter> refusal_of(RobotId sender) const;
  [[nodiscard]] std::optional<MeshCounter> refusal_of(std::span<const std::uint8_t> plain,
                                                      const PeerHeader& header, Timestamp arrival,
                                                      const Endpoint& from);
  [[nodiscard]] bool is_our_own(const PeerHeader& header) const;
  [[nodiscard]] bool is_back(const PeerHeader& header, const Endpoint& from) const;
  [[nodiscard]] std::uint64_t own_session() const;
  [[nodiscard]] Pace pace(Timestamp now) const;
  [[nodiscard]] double forwarded_air(Timestamp now) const;
  [[nodiscard]] WireLimits limits(Timestamp now, std::size_t overhead, std::uint32_t mark) const;
  [[nodiscard]] Timestamp samples_sent(std::size_t copies) const;

  RobotId self_;
  SendSettings settings_;
  PeerSessions sessions_;
  MeshTrust trust_;
  SignatureLimiter limiter_;
  std::deque<std::pair<Timestamp, std::size_t>> forwarded_;  ///< bytes, in the last second
  std::deque<Timestamp> newest_samples_;  ///< of the IMU, in each of the latest datagrams
  std::optional<Timestamp> first_sent_;
  std::uint32_t next_sequence_ = 0;
};

}  // namespace crepes
