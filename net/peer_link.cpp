#include "net/peer_link.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

constexpr Duration kEchoAge = std::chrono::seconds{1};      // older arrivals are not echoed
constexpr Duration kMaxEchoAge = std::chrono::seconds{10};  // nor believed

Report to_local(const PeerReport& theirs, const ClockOffset& clock) {
  Report ours;
  ours.sender = theirs.sender;
  ours.stamp = clock.to_local(theirs.stamp);
  ours.tilt = {clock.to_local(theirs.tilt.stamp), theirs.tilt.up_B, theirs.tilt.sigma_rad};
  for (const auto& [stamp, gyro, accel] : theirs.imu)
    ours.imu.push_back({clock.to_local(stamp), gyro, accel});
  for (const auto& [stamp, neighbor, u_B, p_B_C, sigma] : theirs.bearings)
    ours.bearings.push_back({clock.to_local(stamp), neighbor, u_B, p_B_C, sigma});
  for (const auto& [stamp, neighbor, range, first_path, received] : theirs.ranges)
    ours.ranges.push_back({clock.to_local(stamp), neighbor, range, first_path, received});
  for (const auto& [stamp, neighbor, T_B_N, v_B_N] : theirs.estimates)
    ours.estimates.push_back({clock.to_local(stamp), neighbor, T_B_N, v_B_N});
  return ours;
}

/// The message, or why there is none.
tl::expected<PeerMessage, std::string_view> decode(std::span<const std::uint8_t> datagram,
                                                   const std::optional<PacketSeal>& seal) {
  constexpr auto kName = [](auto fault) { return name_of(fault); };
  if (!seal && PacketSeal::is_on(datagram))
    return tl::unexpected<std::string_view>("seal_unexpected");
  if (!seal) return decode_peer_message(datagram).map_error(kName);
  return seal->open(datagram).map_error(kName).and_then(
      [&](const auto& plain) { return decode_peer_message(plain).map_error(kName); });
}

}  // namespace

PeerLink::PeerLink(RobotId self, const std::vector<RobotId>& members) : self_(self) {
  set_members(members);
}

void PeerLink::set_members(const std::vector<RobotId>& members) {
  std::erase_if(peers_, [&](const auto& peer) {
    return std::find(members.begin(), members.end(), peer.first) == members.end();
  });
  for (const RobotId member : members)
    if (member != self_) peers_.try_emplace(member);
}

void PeerLink::count(std::string_view what, std::uint64_t by) {
  counters_.try_emplace(std::string(what), 0).first->second += by;
}

std::optional<ReceivedReport> PeerLink::receive(std::span<const std::uint8_t> datagram,
                                                Timestamp arrival,
                                                const std::optional<PacketSeal>& seal) {
  auto message = open(datagram, seal);
  if (!message) return std::nullopt;
  const auto found = peers_.find(message->report.sender);
  if (found == peers_.end()) {
    count("refused_unknown_sender");
    return std::nullopt;
  }
  Peer& peer = found->second;
  Session* session = admit(peer, *message);
  if (session == nullptr) return std::nullopt;
  session->last_arrival = arrival;
  if (!tell_clock(*session, *message, arrival)) return std::nullopt;
  if (peer.newcomer && peer.newcomer->hears_us) {
    succeed(peer);
    session = &*peer.live;
  }
  if (!session->clock.is_usable()) {
    count("held_clock_unknown");
    return std::nullopt;
  }
  session->redundancy.apply(message->report);
  return ReceivedReport{to_local(message->report, session->clock),
                        session->clock.estimate()->sigma_s};
}

/// A datagram that is not our own, counted.
std::optional<PeerMessage> PeerLink::open(std::span<const std::uint8_t> datagram,
                                          const std::optional<PacketSeal>& seal) {
  auto message = decode(datagram, seal);
  if (message && message->report.sender == self_) {
    const bool is_ours = first_sent_ && message->session == session();
    if (!is_ours) count("refused_own_id");  // another robot goes by our id
    return std::nullopt;
  }
  count("received");
  count("received_bytes", datagram.size());
  if (message) return std::move(*message);
  count("refused_" + std::string(message.error()));
  return std::nullopt;
}

/// The session that the message is of, if the message is new in it.
PeerLink::Session* PeerLink::admit(Peer& peer, const PeerMessage& message) {
  if (peer.ended.contains(message.session)) {
    count("refused_old_session");  // overtaken by the new one, or played again
    return nullptr;
  }
  const auto is_it = [&](const std::optional<Session>& session) {
    return session && session->id == message.session;
  };
  if (!is_it(peer.live) && !is_it(peer.newcomer)) {
    Session fresh;
    fresh.id = message.session;
    fresh.traffic.peer = message.report.sender;
    peer.newcomer = std::move(fresh);
  }
  Session& session = is_it(peer.live) ? *peer.live : *peer.newcomer;
  switch (session.sequence.accept(message.sequence)) {
    case SequenceWindow::Verdict::kNew:
      return &session;
    case SequenceWindow::Verdict::kDuplicate:
      count("refused_duplicate");
      return nullptr;
    case SequenceWindow::Verdict::kTooOld:
      count("refused_too_old");
      return nullptr;
  }
  return nullptr;
}

/// False when the message's stamps contradict the peer's clock as known.
bool PeerLink::tell_clock(Session& session, const PeerMessage& message, Timestamp arrival) {
  const auto verdict = session.clock.packet_arrived({message.sent, arrival});
  if (verdict == ClockOffset::Verdict::kRestarted) ++session.traffic.restarts;
  if (verdict != ClockOffset::Verdict::kUsed) {
    count("refused_clock_jump");
    return false;
  }
  for (const ClockEcho& echo : message.echoes) {
    if (echo.peer != self_) continue;
    const Timestamp sent{Duration{echo.sent_ns}};
    if (!is_own_datagram(sent, arrival)) {
      count("refused_echo");
      continue;
    }
    session.hears_us = true;
    const PeerTimestamp reached{Duration{echo.received_ns}};
    switch (session.clock.packet_echoed(sent, reached, arrival)) {
      case ClockOffset::Verdict::kUsed:
        break;
      case ClockOffset::Verdict::kRestarted:
        ++session.traffic.restarts;
        [[fallthrough]];
      case ClockOffset::Verdict::kImplausible:
        count("refused_clock_jump");
        return false;
    }
  }
  return true;
}

/// The newcomer takes the place of the session before.
void PeerLink::succeed(Peer& peer) {
  Session next = std::move(*peer.newcomer);
  peer.newcomer.reset();
  if (peer.live) {
    const PeerTraffic& before = peer.live->traffic;
    next.traffic.received += before.received + peer.live->sequence.received();
    next.traffic.lost += before.lost + peer.live->sequence.lost();
    next.traffic.restarts += before.restarts + 1;
    peer.ended.insert(peer.live->id);
  }
  peer.live = std::move(next);
}

bool PeerLink::is_own_datagram(Timestamp sent, Timestamp now) const {
  return sent > now - kMaxEchoAge && std::ranges::binary_search(sent_, sent);
}

/// Differs from the last start's: the clock has moved on, or began anew with the machine.
std::uint32_t PeerLink::session() const {
  const auto ns = static_cast<std::uint64_t>(to_ns(*first_sent_));
  return static_cast<std::uint32_t>(ns ^ (ns >> 32U));
}

std::vector<std::uint8_t> PeerLink::compose(const Report& report, Timestamp now,
                                            const std::optional<PacketSeal>& seal) {
  CREPES_EXPECT(report.sender == self_, "a robot reports for itself");
  if (!first_sent_) first_sent_ = now;
  sent_.push_back(now);
  while (sent_.front() <= now - kMaxEchoAge) sent_.pop_front();
  OutgoingPeerMessage message{.report = report,
                              .sent = now,
                              .session = session(),
                              .sequence = next_sequence_++,
                              .echoes = {}};
  for (const auto& [id, peer] : peers_) {
    for (const std::optional<Session>* known : {&peer.live, &peer.newcomer}) {
      const auto packet = *known ? (*known)->clock.fastest_recent_packet() : std::nullopt;
      if (packet && packet->arrival <= now && packet->arrival > now - kEchoAge)
        message.echoes.push_back({id, to_ns(packet->sent), to_ns(packet->arrival)});
    }
  }
  EncodedPeerMessage encoded =
      encode_peer_message(message, kMaxPeerMessage - (seal ? PacketSeal::kOverhead : 0));
  if (seal) encoded.bytes = seal->seal(encoded.bytes);
  count("sent");
  count("sent_bytes", encoded.bytes.size());
  if (encoded.left_out > 0) count("left_out_of_datagrams", encoded.left_out);
  if (encoded.refused > 0) count("refused_to_send", encoded.refused);
  return std::move(encoded.bytes);
}

std::vector<ClockStatus> PeerLink::clocks() const {
  std::vector<ClockStatus> known;
  for (const auto& [id, peer] : peers_) {
    const auto clock = peer.live ? peer.live->clock.estimate() : std::nullopt;
    if (clock && peer.live->clock.is_usable())
      known.push_back({id, clock->offset_s, clock->skew * 1e6, clock->sigma_s});
  }
  return known;
}

std::vector<PeerTraffic> PeerLink::traffic(Timestamp now) const {
  std::vector<PeerTraffic> heard;
  for (const auto& [id, peer] : peers_) {
    const std::optional<Session>& session = peer.heard();
    if (!session) continue;
    heard.push_back(session->traffic);
    heard.back().received += session->sequence.received();
    heard.back().lost += session->sequence.lost();
    heard.back().age_s = to_seconds(now - session->last_arrival);
  }
  return heard;
}

std::vector<std::pair<std::string, std::uint64_t>> PeerLink::counters() const {
  return {counters_.begin(), counters_.end()};
}

}  // namespace crepes
