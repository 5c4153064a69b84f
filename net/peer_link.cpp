#include "net/peer_link.hpp"

#include <algorithm>
#include <chrono>

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

}  // namespace

PeerLink::PeerLink(RobotId self, const std::vector<RobotId>& members) : self_(self) {
  set_members(members);
}

void PeerLink::set_members(const std::vector<RobotId>& members) {
  std::erase_if(peers_, [&](const auto& peer) {
    return std::find(members.begin(), members.end(), peer.first) == members.end();
  });
  for (const RobotId member : members)
    if (member != self_) peers_.try_emplace(member, std::nullopt);
}

void PeerLink::count(std::string_view what, std::uint64_t by) {
  counters_.try_emplace(std::string(what), 0).first->second += by;
}

std::optional<ReceivedReport> PeerLink::receive(std::span<const std::uint8_t> datagram,
                                                Timestamp arrival) {
  auto message = decode_peer_message(datagram);
  if (message && message->report.sender == self_) {
    const bool is_ours = first_sent_ && message->session == session();
    if (!is_ours) count("refused_own_id");  // another robot goes by our id
    return std::nullopt;
  }
  count("received");
  count("received_bytes", datagram.size());
  if (!message) {
    count("refused_" + std::string(name_of(message.error())));
    return std::nullopt;
  }
  Peer* const peer = admit(*message);
  if (peer == nullptr) return std::nullopt;
  peer->last_arrival = arrival;
  if (!tell_clock(*peer, *message, arrival)) return std::nullopt;
  if (!peer->clock.is_usable()) {
    count("held_clock_unknown");
    return std::nullopt;
  }
  peer->redundancy.apply(message->report);
  return ReceivedReport{to_local(message->report, peer->clock), peer->clock.estimate()->sigma_s};
}

/// The sender, if the message is from a member and new.
PeerLink::Peer* PeerLink::admit(const PeerMessage& message) {
  const auto found = peers_.find(message.report.sender);
  if (found == peers_.end()) {
    count("refused_unknown_sender");
    return nullptr;
  }
  std::optional<Peer>& peer = found->second;
  if (peer && message.session != peer->session && message.session == peer->previous_session) {
    count("refused_old_session");  // overtaken by the first datagrams of the new one
    return nullptr;
  }
  if (!peer || message.session != peer->session) {
    Peer fresh;
    fresh.session = message.session;
    fresh.traffic.peer = found->first;
    if (peer) {
      fresh.previous_session = peer->session;
      fresh.traffic = peer->traffic;
      fresh.traffic.received += peer->sequence.received();
      fresh.traffic.lost += peer->sequence.lost();
      ++fresh.traffic.restarts;
    }
    peer = std::move(fresh);
  }
  switch (peer->sequence.accept(message.sequence)) {
    case SequenceWindow::Verdict::kNew:
      return &*peer;
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
bool PeerLink::tell_clock(Peer& peer, const PeerMessage& message, Timestamp arrival) {
  const auto verdict = peer.clock.packet_arrived({message.sent, arrival});
  if (verdict == ClockOffset::Verdict::kRestarted) ++peer.traffic.restarts;
  if (verdict != ClockOffset::Verdict::kUsed) {
    count("refused_clock_jump");
    return false;
  }
  for (const ClockEcho& echo : message.echoes) {
    if (echo.peer != self_) continue;
    const Timestamp sent{Duration{echo.sent_ns}};
    const bool ours =
        first_sent_ && sent >= *first_sent_ && sent <= arrival && sent > arrival - kMaxEchoAge;
    if (!ours) {
      count("refused_echo");
      continue;
    }
    const PeerTimestamp reached{Duration{echo.received_ns}};
    switch (peer.clock.packet_echoed(sent, reached, arrival)) {
      case ClockOffset::Verdict::kUsed:
        break;
      case ClockOffset::Verdict::kRestarted:
        ++peer.traffic.restarts;
        [[fallthrough]];
      case ClockOffset::Verdict::kImplausible:
        count("refused_clock_jump");
        return false;
    }
  }
  return true;
}

/// Differs from the last start's: the clock has moved on, or began anew with the machine.
std::uint32_t PeerLink::session() const {
  const auto ns = static_cast<std::uint64_t>(to_ns(*first_sent_));
  return static_cast<std::uint32_t>(ns ^ (ns >> 32U));
}

std::vector<std::uint8_t> PeerLink::compose(const Report& report, Timestamp now) {
  CREPES_EXPECT(report.sender == self_, "a robot reports for itself");
  if (!first_sent_) first_sent_ = now;
  OutgoingPeerMessage message{.report = report,
                              .sent = now,
                              .session = session(),
                              .sequence = next_sequence_++,
                              .echoes = {}};
  for (const auto& [id, peer] : peers_) {
    const auto packet = peer ? peer->clock.fastest_recent_packet() : std::nullopt;
    if (packet && packet->arrival <= now && packet->arrival > now - kEchoAge)
      message.echoes.push_back({id, to_ns(packet->sent), to_ns(packet->arrival)});
  }
  EncodedPeerMessage encoded = encode_peer_message(message);
  count("sent");
  count("sent_bytes", encoded.bytes.size());
  if (encoded.left_out > 0) count("left_out_of_datagrams", encoded.left_out);
  if (encoded.refused > 0) count("refused_to_send", encoded.refused);
  return std::move(encoded.bytes);
}

std::vector<ClockStatus> PeerLink::clocks() const {
  std::vector<ClockStatus> known;
  for (const auto& [id, peer] : peers_) {
    const auto clock = peer ? peer->clock.estimate() : std::nullopt;
    if (clock && peer->clock.is_usable())
      known.push_back({id, clock->offset_s, clock->skew * 1e6, clock->sigma_s});
  }
  return known;
}

std::vector<PeerTraffic> PeerLink::traffic(Timestamp now) const {
  std::vector<PeerTraffic> heard;
  for (const auto& [id, peer] : peers_) {
    if (!peer) continue;
    heard.push_back(peer->traffic);
    heard.back().received += peer->sequence.received();
    heard.back().lost += peer->sequence.lost();
    heard.back().age_s = to_seconds(now - peer->last_arrival);
  }
  return heard;
}

std::vector<std::pair<std::string, std::uint64_t>> PeerLink::counters() const {
  return {counters_.begin(), counters_.end()};
}

}  // namespace crepes
