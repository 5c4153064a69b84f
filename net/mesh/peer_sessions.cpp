#include "net/mesh/peer_sessions.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

namespace crepes {
namespace {

constexpr Duration kEchoAge = std::chrono::seconds{1};  // older packets are not echoed
constexpr Duration kSilence = std::chrono::seconds{1};  // after which a replaced session may return
constexpr Duration kTakeover = std::chrono::milliseconds{500};  // silence before a new one is live
constexpr Duration kLatest = std::chrono::milliseconds{300};    // datagrams of one that has ended
constexpr std::size_t kMaxEnded = 16;  // sessions of a peer that are remembered
constexpr double kMaxRateHz = 250.0;   // of a peer's datagrams
constexpr double kUnknownLoss = 0.2;

/// How far a number may be ahead after a silence. Those of the window remain valid in any case.
std::uint32_t max_ahead(Duration silence) {
  constexpr double kMost = 1e9;
  const double missed = kMaxRateHz * std::max(0.0, to_seconds(silence));
  return SequenceWindow::kSize - 1 + static_cast<std::uint32_t>(std::min(kMost, missed));
}

/// The counter of datagrams that are refused by their number; empty if it is new.
std::optional<MeshCounter> refusal_of(SequenceWindow::Verdict verdict) {
  switch (verdict) {
    case SequenceWindow::Verdict::kNew:
      return std::nullopt;
    case SequenceWindow::Verdict::kDuplicate:
      return MeshCounter::kRefusedDuplicate;
    case SequenceWindow::Verdict::kTooOld:
      return MeshCounter::kRefusedTooOld;
    case SequenceWindow::Verdict::kTooFarAhead:
      return MeshCounter::kRefusedTooFarAhead;
  }
  return std::nullopt;
}

}  // namespace

void PeerSessions::set_members(const std::vector<RobotId>& members) {
  std::erase_if(peers_, [&](const auto& peer) {
    return std::find(members.begin(), members.end(), peer.first) == members.end();
  });
  for (const RobotId member : members)
    if (member != self_) peers_.try_emplace(member);
}

std::optional<MeshCounter> PeerSessions::refusal_of(const PeerHeader& header, Timestamp arrival,
                                                    const Endpoint& from) {
  const auto peer = peers_.find(header.sender);
  if (peer == peers_.end()) return std::nullopt;
  for (const std::optional<Session>* known : {&peer->second.live, &peer->second.candidate}) {
    if (!*known || (*known)->id != header.session) continue;
    const Session& session = **known;
    const auto refusal = crepes::refusal_of(
        session.sequence.judge(header.sequence, max_ahead(arrival - session.last_arrival)));
    if (refusal)
      return counted_copy(*refusal, {header.sender, header.session, header.sequence}, from);
  }
  return std::nullopt;
}

std::optional<PeerSessions::Accepted> PeerSessions::accept(const PeerMessage& message,
                                                           Timestamp arrival,
                                                           const Endpoint& from) {
  Peer& peer = peers_.at(message.report.sender);
  Session* const session = accepted_by(peer, message, arrival, from);
  if (session == nullptr) return std::nullopt;
  const bool is_live = peer.live && session == &*peer.live;
  if (is_live) record_reachability(message, arrival, from);
  return Accepted{session, is_live};
}

/// The counter of a datagram that was refused by its number.
MeshCounter PeerSessions::counted_copy(MeshCounter refusal, const DatagramId& id,
                                       const Endpoint& from) {
  if (refusal != MeshCounter::kRefusedDuplicate || !relay_.record_copy(id, from)) return refusal;
  return MeshCounter::kReceivedAgain;
}

void PeerSessions::record_reachability(const PeerMessage& message, Timestamp arrival,
                                       const Endpoint& from) {
  if (message.mark == 0) relay_.record_heard(message.report.sender, from, arrival);
  for (const ClockEcho& echo : message.echoes) {
    if (echo.is_direct && (echo.peer == self_ || peers_.contains(echo.peer)))
      relay_.record_hears(message.report.sender, echo.peer, arrival);
  }
}

/// The session of the message, if the message is new in it and its stamps agree with it. A session
/// that has echoed us is the live one now, if the former one is silent.
PeerSessions::Session* PeerSessions::accepted_by(Peer& peer, const PeerMessage& message,
                                                 Timestamp arrival, const Endpoint& from) {
  Session* const session = admit(peer, message, arrival, from);
  if (session == nullptr) return nullptr;
  session->last_arrival = arrival;
  if (!update_clock(*session, message, arrival)) return nullptr;
  const bool is_candidate = peer.candidate && session == &*peer.candidate;
  if (!is_candidate || !session->has_echoed_us) return session;
  if (peer.live && arrival - peer.live->last_arrival < kTakeover) {
    const bool are_two = peer.live->last_arrival - session->first_arrival > kLatest;
    are_two ? count_doubled(MeshCounter::kRefusedDoubledId, message.report.sender, arrival)
            : counters_.add(MeshCounter::kHeldClockUnknown);
    return nullptr;
  }
  replace_session(peer, arrival);
  return &*peer.live;
}

void PeerSessions::count_doubled(MeshCounter counter, RobotId robot, Timestamp now) {
  counters_.add(counter);
  doubled_ = {robot, now};
}

/// The session of the message, if the message is new in it.
PeerSessions::Session* PeerSessions::admit(Peer& peer, const PeerMessage& message,
                                           Timestamp arrival, const Endpoint& from) {
  if (!readmit(peer, message, arrival)) return nullptr;
  const auto is_it = [&](const std::optional<Session>& session) {
    return session && session->id == message.session;
  };
  if (!is_it(peer.live) && !is_it(peer.candidate)) {
    Session fresh;
    fresh.id = message.session;
    fresh.traffic.peer = message.report.sender;
    fresh.first_arrival = arrival;
    fresh.last_arrival = arrival;
    peer.candidate = std::move(fresh);
  }
  Session& session = is_it(peer.live) ? *peer.live : *peer.candidate;
  const auto refusal = crepes::refusal_of(
      session.sequence.accept(message.sequence, max_ahead(arrival - session.last_arrival)));
  if (refusal) {
    counters_.add(
        counted_copy(*refusal, {message.report.sender, message.session, message.sequence}, from));
    return nullptr;
  }
  update_loss(session, message, arrival);
  return &session;
}

/// False if the message is of a session that was replaced and may not return. A message that echoes
/// what we sent since then is no recording: two robots have the peer's id.
bool PeerSessions::readmit(Peer& peer, const PeerMessage& message, Timestamp arrival) {
  const auto ended = std::ranges::find(peer.ended, message.session, &EndedSession::id);
  if (ended == peer.ended.end()) return true;
  const bool is_alive = std::ranges::any_of(message.echoes, [&](const ClockEcho& echo) {
    const auto sent = sent_.find(echo.sent_code, arrival);
    return echo.peer == self_ && sent && *sent > ended->at;
  });
  if (!is_alive) {
    counters_.add(MeshCounter::kRefusedOldSession);  // delayed or replayed
    return false;
  }
  if (peer.live && arrival - peer.live->last_arrival < kSilence) {
    count_doubled(MeshCounter::kRefusedDoubledId, message.report.sender, arrival);
    return false;
  }
  peer.ended.erase(ended);
  return true;
}

/// False when the stamps of the message contradict the estimate of the peer's clock.
bool PeerSessions::update_clock(Session& session, const PeerMessage& message, Timestamp arrival) {
  const auto verdict = session.clock.add_packet({message.sent, arrival});
  if (verdict == ClockOffset::Verdict::kRestarted) ++session.traffic.restarts;
  if (verdict != ClockOffset::Verdict::kUsed) {
    counters_.add(MeshCounter::kRefusedClockJump);
    return false;
  }
  for (const ClockEcho& echo : message.echoes) {
    if (echo.peer != self_) continue;
    const auto sent = sent_.find(echo.sent_code, arrival);
    if (!sent) {
      counters_.add(MeshCounter::kRefusedEcho);
      continue;
    }
    session.has_echoed_us = true;
    session.loss_of_ours = echo.loss;
    const PeerTimestamp reached{Duration{echo.received_ns}};
    switch (session.clock.add_echo(*sent, reached, arrival)) {
      case ClockOffset::Verdict::kUsed:
        break;
      case ClockOffset::Verdict::kRestarted:
        ++session.traffic.restarts;
        [[fallthrough]];
      case ClockOffset::Verdict::kImplausible:
        counters_.add(MeshCounter::kRefusedClockJump);
        return false;
    }
  }
  return true;
}

/// The candidate replaces the live session.
void PeerSessions::replace_session(Peer& peer, Timestamp now) {
  Session next = std::move(*peer.candidate);
  peer.candidate.reset();
  if (peer.live) {
    const PeerTraffic& before = peer.live->traffic;
    next.traffic.received += before.received + peer.live->sequence.received();
    next.traffic.lost += before.lost + peer.live->loss.lost();
    next.traffic.restarts += before.restarts + 1;
    peer.ended.push_back({peer.live->id, now});
    if (peer.ended.size() > kMaxEnded) peer.ended.pop_front();
  }
  peer.live = std::move(next);
}

/// Updates the share of the peer's datagrams that do not arrive.
void PeerSessions::update_loss(Session& session, const PeerMessage& message,
                               Timestamp arrival) const {
  if (message.mark == 0 || relay_.is_heard(message.report.sender, arrival)) {
    session.loss.update(session.sequence.lost());
  } else {
    session.loss.update_forwarded(session.sequence.lost(), message.sequence, message.mark);
  }
}

std::size_t PeerSessions::heard_directly(Timestamp now) const {
  const auto count = std::ranges::count_if(peers_, [&](const auto& known) {
    const std::optional<Session>& session = known.second.heard();
    return session && now - session->last_arrival <= kEchoAge &&
           (!known.second.live || relay_.is_heard(known.first, now));
  });
  return static_cast<std::size_t>(count);
}

double PeerSessions::worst_loss_of_ours(Timestamp now) const {
  std::optional<double> worst;
  for (const auto& [id, peer] : peers_) {
    if (!peer.live || now - peer.live->last_arrival > kEchoAge || !relay_.is_heard(id, now))
      continue;
    worst = std::max(worst.value_or(0.0), peer.live->loss_of_ours.value_or(kUnknownLoss));
  }
  return worst.value_or(kUnknownLoss);
}

std::vector<ClockEcho> PeerSessions::echoes(Timestamp now) const {
  std::vector<ClockEcho> echoes;
  for (const auto& [id, peer] : peers_) {
    for (const std::optional<Session>* known : {&peer.live, &peer.candidate}) {
      const auto packet = *known ? (*known)->clock.fastest_recent_packet() : std::nullopt;
      if (!packet || packet->arrival > now || packet->arrival <= now - kEchoAge) continue;
      echoes.push_back({.peer = id,
                        .sent_code = echo_code(to_ns(packet->sent)),
                        .received_ns = to_ns(packet->arrival),
                        .loss = (*known)->loss.share(),
                        .is_direct = relay_.is_heard(id, now)});
    }
  }
  return echoes;
}

std::vector<ClockStatus> PeerSessions::clocks() const {
  std::vector<ClockStatus> known;
  for (const auto& [id, peer] : peers_) {
    const auto clock = peer.live ? peer.live->clock.estimate() : std::nullopt;
    if (clock && peer.live->clock.is_usable())
      known.push_back({id, clock->offset_s, clock->skew * 1e6, clock->sigma_s});
  }
  return known;
}

std::vector<PeerTraffic> PeerSessions::traffic(Timestamp now) const {
  std::vector<PeerTraffic> heard;
  for (const auto& [id, peer] : peers_) {
    const std::optional<Session>& session = peer.heard();
    if (!session) continue;
    heard.push_back(session->traffic);
    heard.back().received += session->sequence.received();
    heard.back().lost += session->loss.lost();
    heard.back().age_s = to_seconds(now - session->last_arrival);
    heard.back().loss = session->loss.share();
  }
  return heard;
}

}  // namespace crepes
