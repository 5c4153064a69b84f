#include "net/mesh/peer_link.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

constexpr Duration kEchoAge = std::chrono::seconds{1};      // older packets are not echoed
constexpr Duration kMaxEchoAge = std::chrono::seconds{10};  // older echoes are refused
constexpr Duration kSilence = std::chrono::seconds{1};  // after which a replaced session may return
constexpr Duration kTakeover = std::chrono::milliseconds{500};  // silence before a new one is live
constexpr Duration kLatest = std::chrono::milliseconds{300};    // datagrams of one that has ended
constexpr std::size_t kMaxEnded = 16;  // sessions of a peer that are remembered
constexpr Duration kForwardedAge = std::chrono::seconds{1};
constexpr std::size_t kMarkedCopies = 2;
constexpr double kMaxRateHz = 250.0;  // of a peer's datagrams

Report to_local(const PeerReport& theirs, const ClockOffset& clock) {
  Report ours;
  ours.sender = theirs.sender;
  ours.stamp = clock.to_local(theirs.stamp);
  ours.tilt = {clock.to_local(theirs.tilt.stamp), theirs.tilt.up_B, theirs.tilt.sigma_rad};
  for (const auto& [stamp, gyro, accel] : theirs.imu)
    ours.imu.push_back({clock.to_local(stamp), gyro, accel});
  for (const auto& [stamp, neighbor, u_B, p_B_C, sigma, how] : theirs.bearings)
    ours.bearings.push_back({clock.to_local(stamp), neighbor, u_B, p_B_C, sigma, how});
  for (const auto& [stamp, neighbor, range, first_path, received] : theirs.ranges)
    ours.ranges.push_back({clock.to_local(stamp), neighbor, range, first_path, received});
  for (const auto& [stamp, neighbor, T_B_N, v_B_N] : theirs.estimates)
    ours.estimates.push_back({clock.to_local(stamp), neighbor, T_B_N, v_B_N});
  return ours;
}

/// How far a number may be ahead after a silence. Those of the window remain valid in any case.
std::uint32_t max_ahead(Duration silence) {
  constexpr double kMost = 1e9;
  const double missed = kMaxRateHz * std::max(0.0, to_seconds(silence));
  return SequenceWindow::kSize - 1 + static_cast<std::uint32_t>(std::min(kMost, missed));
}

constexpr auto kCounterOf = [](auto error) { return counter_of(error); };

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

/// Marked datagrams are half as long again as the mean, the others shorter by as much in all.
std::size_t bytes_of(const Pace& pace, bool is_marked, bool are_some_marked) {
  constexpr double kMarked = 1.5;
  const double spacing = mark_spacing(pace.reports);
  const double share = !are_some_marked ? 1.0
                       : is_marked      ? kMarked
                                        : (spacing - kMarked) / (spacing - 1);
  return static_cast<std::size_t>(share * static_cast<double>(pace.bytes));
}

/// The datagram without its seal, or the counter of the reason why it cannot be opened.
tl::expected<std::vector<std::uint8_t>, MeshCounter> unsealed(
    std::span<const std::uint8_t> datagram, const std::optional<PacketSeal>& seal) {
  if (seal) return seal->open(datagram).map_error(kCounterOf);
  if (PacketSeal::is_sealed(datagram)) return tl::unexpected(MeshCounter::kRefusedSealUnexpected);
  return std::vector<std::uint8_t>(datagram.begin(), datagram.end());
}

}  // namespace

PeerLink::PeerLink(RobotId self, const std::vector<RobotId>& members, const SendSettings& settings)
    : self_(self), settings_(settings), relay_(self) {
  set_members(members);
}

void PeerLink::set_pacing(const SendSettings& settings) {
  const std::uint64_t salt = settings_.session_salt;
  settings_ = settings;
  settings_.session_salt = salt;
}

void PeerLink::set_members(const std::vector<RobotId>& members) {
  std::erase_if(peers_, [&](const auto& peer) {
    return std::find(members.begin(), members.end(), peer.first) == members.end();
  });
  for (const RobotId member : members)
    if (member != self_) peers_.try_emplace(member);
}

std::optional<ReceivedReport> PeerLink::receive(std::span<const std::uint8_t> datagram,
                                                Timestamp arrival,
                                                const std::optional<PacketSeal>& seal,
                                                const Endpoint& from) {
  auto message = open(datagram, arrival, seal, from);
  if (!message) return std::nullopt;
  const RobotId sender = message->report.sender;
  Peer& peer = peers_.at(sender);
  Session* const session = accept(peer, *message, arrival, from);
  if (trust_.keys.contains(sender)) {
    const bool is_of_use = session != nullptr && peer.live && session == &*peer.live;
    is_of_use ? limiter_.count_accepted(from, sender, arrival)
              : limiter_.count_in_vain(from, sender, arrival);
  }
  if (session == nullptr) return std::nullopt;
  const bool is_live = peer.live && session == &*peer.live;
  if (is_live || !peer.live) note_who_hears_whom(*message, arrival, from);
  if (is_live && message->mark > 0)
    relay_.offer({sender, message->session, message->sequence}, datagram, from, arrival);
  if (!session->clock.is_usable()) {
    counters_.add(MeshCounter::kHeldClockUnknown);
    return std::nullopt;
  }
  session->redundancy.remove_repeated(message->report);
  return ReceivedReport{to_local(message->report, session->clock),
                        session->clock.estimate()->sigma_s};
}

/// Reads and counts a datagram of a peer; empty if it is our own or refused.
std::optional<PeerMessage> PeerLink::open(std::span<const std::uint8_t> datagram, Timestamp arrival,
                                          const std::optional<PacketSeal>& seal,
                                          const Endpoint& from) {
  const auto plain = unsealed(datagram, seal);
  const auto header =
      plain ? decode_peer_header(*plain).map_error(kCounterOf) : tl::unexpected(plain.error());
  if (header && is_our_own(*header)) return std::nullopt;
  auto message = header.and_then([&](const PeerHeader&) { return read(*plain, arrival, from); });
  if (message && message->report.sender == self_) {
    if (trust_.keys.contains(self_)) limiter_.count_in_vain(from, self_, arrival);
    count_doubled(MeshCounter::kRefusedOwnId, self_, arrival);
    return std::nullopt;
  }
  counters_.add(MeshCounter::kReceived);
  counters_.add(MeshCounter::kReceivedBytes, datagram.size());
  if (message) return std::move(*message);
  counters_.add(message.error());
  return std::nullopt;
}

/// The message of a member, or the counter of the reason why it is refused.
tl::expected<PeerMessage, MeshCounter> PeerLink::read(std::span<const std::uint8_t> plain,
                                                      Timestamp arrival, const Endpoint& from) {
  if (is_signed(plain)) {
    if (const auto refusal = refusal_of(plain, *decode_peer_header(plain), arrival, from))
      return tl::unexpected(*refusal);
    return decode_peer_message(without_signature(plain)).map_error(kCounterOf);
  }
  auto message = decode_peer_message(plain).map_error(kCounterOf);
  if (!message) return message;
  if (const auto refusal = refusal_of(message->report.sender)) return tl::unexpected(*refusal);
  if (trust_.keys.contains(message->report.sender))
    return tl::unexpected(MeshCounter::kRefusedSignatureMissing);
  return message;
}

std::optional<MeshCounter> PeerLink::refusal_of(RobotId sender) const {
  if (trust_.excluded.contains(sender)) return MeshCounter::kRefusedExcluded;
  if (sender != self_ && !peers_.contains(sender)) return MeshCounter::kRefusedUnknownSender;
  return std::nullopt;
}

/// Cheap checks first: to verify a signature is by far the most expensive one.
std::optional<MeshCounter> PeerLink::refusal_of(std::span<const std::uint8_t> plain,
                                                const PeerHeader& header, Timestamp arrival,
                                                const Endpoint& from) {
  if (const auto refusal = refusal_of(header.sender)) return refusal;
  const auto key = trust_.keys.find(header.sender);
  if (key == trust_.keys.end()) return std::nullopt;
  if (const auto peer = peers_.find(header.sender); peer != peers_.end()) {
    for (const std::optional<Session>* known : {&peer->second.live, &peer->second.candidate}) {
      if (!*known || (*known)->id != header.session) continue;
      const Session& session = **known;
      const auto refusal = crepes::refusal_of(
          session.sequence.judge(header.sequence, max_ahead(arrival - session.last_arrival)));
      if (refusal)
        return counted_copy(*refusal, {header.sender, header.session, header.sequence}, from);
    }
  }
  if (!limiter_.allows(from, header.sender, arrival))
    return MeshCounter::kRefusedSignatureUnchecked;
  if (is_authentic(plain, key->second)) return std::nullopt;
  limiter_.count_in_vain(from, header.sender, arrival);
  return MeshCounter::kRefusedSignatureWrong;
}

/// The counter of a datagram that was refused by its number.
MeshCounter PeerLink::counted_copy(MeshCounter refusal, const DatagramId& id,
                                   const Endpoint& from) {
  if (refusal != MeshCounter::kRefusedDuplicate || !relay_.note_copy(id, from)) return refusal;
  return MeshCounter::kReceivedAgain;
}

void PeerLink::note_who_hears_whom(const PeerMessage& message, Timestamp arrival,
                                   const Endpoint& from) {
  if (message.mark == 0) relay_.note_heard(message.report.sender, from, arrival);
  for (const ClockEcho& echo : message.echoes)
    if (echo.is_direct && (echo.peer == self_ || peers_.contains(echo.peer)))
      relay_.note_hears(message.report.sender, echo.peer, arrival);
}

bool PeerLink::is_our_own(const PeerHeader& header) const {
  return header.sender == self_ && first_sent_ && header.session == own_session();
}

/// The session of the message, if the message is new in it and its stamps agree with it. A session
/// that has echoed us is the live one now, if the former one is silent.
PeerLink::Session* PeerLink::accept(Peer& peer, const PeerMessage& message, Timestamp arrival,
                                    const Endpoint& from) {
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

void PeerLink::count_doubled(MeshCounter counter, RobotId robot, Timestamp now) {
  counters_.add(counter);
  doubled_ = {robot, now};
}

/// The session of the message, if the message is new in it.
PeerLink::Session* PeerLink::admit(Peer& peer, const PeerMessage& message, Timestamp arrival,
                                   const Endpoint& from) {
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
bool PeerLink::readmit(Peer& peer, const PeerMessage& message, Timestamp arrival) {
  const auto ended = std::ranges::find(peer.ended, message.session, &EndedSession::id);
  if (ended == peer.ended.end()) return true;
  const bool is_alive = std::ranges::any_of(message.echoes, [&](const ClockEcho& echo) {
    const auto sent = sent_by_us(echo.sent_code, arrival);
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
bool PeerLink::update_clock(Session& session, const PeerMessage& message, Timestamp arrival) {
  const auto verdict = session.clock.add_packet({message.sent, arrival});
  if (verdict == ClockOffset::Verdict::kRestarted) ++session.traffic.restarts;
  if (verdict != ClockOffset::Verdict::kUsed) {
    counters_.add(MeshCounter::kRefusedClockJump);
    return false;
  }
  for (const ClockEcho& echo : message.echoes) {
    if (echo.peer != self_) continue;
    const auto sent = sent_by_us(echo.sent_code, arrival);
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
void PeerLink::replace_session(Peer& peer, Timestamp now) {
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
void PeerLink::update_loss(Session& session, const PeerMessage& message, Timestamp arrival) const {
  if (message.mark == 0 || relay_.is_heard(message.report.sender, arrival)) {
    session.loss.update(session.sequence.lost());
  } else {
    session.loss.update_forwarded(session.sequence.lost(), message.sequence, message.mark);
  }
}

/// When we sent the datagram that an echo names, if that was a moment ago.
std::optional<Timestamp> PeerLink::sent_by_us(std::uint32_t code, Timestamp now) const {
  const auto found = std::find_if(sent_.rbegin(), sent_.rend(), [code](Timestamp sent) {
    return echo_code(to_ns(sent)) == code;
  });
  return found != sent_.rend() && *found > now - kMaxEchoAge ? std::optional(*found) : std::nullopt;
}

/// Differs from start to start, because the clock has advanced or the machine has restarted, and
/// with the salt.
std::uint64_t PeerLink::own_session() const {
  return settings_.session_salt ^ static_cast<std::uint64_t>(to_ns(*first_sent_));
}

/// Peers that are heard directly, and new ones.
std::size_t PeerLink::heard_directly(Timestamp now) const {
  const auto count = std::ranges::count_if(peers_, [&](const auto& known) {
    const std::optional<Session>& session = known.second.heard();
    return session && now - session->last_arrival <= kEchoAge &&
           (!known.second.live || relay_.is_heard(known.first, now));
  });
  return static_cast<std::size_t>(count);
}

Pace PeerLink::pace(Timestamp now) const {
  return pace_of(settings_, heard_directly(now), forwarded_air(now));
}

/// Share of the channel's time that forwarding took in the last second.
double PeerLink::forwarded_air(Timestamp now) const {
  double air_s = 0.0;
  for (const auto& [at, bytes] : forwarded_)
    if (now - at < kForwardedAge)
      air_s += airtime(1.0, static_cast<double>(bytes), settings_.broadcasts);
  return air_s / to_seconds(kForwardedAge);
}

std::vector<std::vector<std::uint8_t>> PeerLink::forwards(Timestamp now) {
  while (!forwarded_.empty() && now - forwarded_.front().first >= kForwardedAge)
    forwarded_.pop_front();
  const double most = forwarding_part(settings_, heard_directly(now));
  std::vector<std::vector<std::uint8_t>> due = relay_.take_due(now);
  std::erase_if(due, [&](const auto& bytes) {
    if (forwarded_air(now) >= most) return true;
    forwarded_.emplace_back(now, bytes.size());
    counters_.add(MeshCounter::kForwarded);
    counters_.add(MeshCounter::kForwardedBytes, bytes.size());
    return false;
  });
  return due;
}

bool PeerLink::is_due(Timestamp now) const {
  constexpr double kEarliest = 0.5;  // reports: their times jitter
  if (sent_.empty()) return true;
  const double reports = static_cast<double>(pace(now).reports) - kEarliest;
  return now - sent_.back() >= from_seconds(reports / settings_.rate_hz);
}

/// Of the peer that loses the most, of those that hear us directly or of all.
double PeerLink::worst_loss_of_ours(Timestamp now, bool everywhere) const {
  constexpr double kUnknownLoss = 0.2;
  std::optional<double> worst;
  for (const auto& [id, peer] : peers_) {
    if (!peer.live || now - peer.live->last_arrival > kEchoAge) continue;
    if (!everywhere && !relay_.is_heard(id, now)) continue;
    worst = std::max(worst.value_or(0.0), peer.live->loss_of_ours.value_or(kUnknownLoss));
  }
  return worst.value_or(kUnknownLoss);
}

/// A marked datagram stands for all since the last marked one. With `mark` 0: without the mark.
WireLimits PeerLink::limits(Timestamp now, std::size_t overhead, std::uint32_t mark) const {
  const Pace pace = this->pace(now);
  const std::size_t reports = pace.reports * std::max<std::size_t>(mark, 1);
  const std::size_t most = bytes_of(pace, mark > 0, relay_.is_needed(now));
  return {.bytes = std::clamp(most, kMinPeerMessage + overhead, kMaxPeerMessage) - overhead,
          .copies = mark > 0 ? kMarkedCopies : copies_for(worst_loss_of_ours(now, false)),
          .period = from_seconds(static_cast<double>(reports) / settings_.rate_hz),
          .reports = reports,
          .gyro_step_radps = settings_.gyro_step_radps,
          .accel_step_mps2 = settings_.accel_step_mps2};
}

std::vector<std::uint8_t> PeerLink::compose(const Report& report, Timestamp now,
                                            const std::optional<PacketSeal>& seal,
                                            const std::optional<PacketSigner>& signer) {
  CREPES_EXPECT(report.sender == self_, "a robot reports for itself");
  if (!first_sent_) first_sent_ = now;
  const std::size_t reports = pace(now).reports;
  const std::uint32_t spacing = mark_spacing(reports);
  relay_.set_period(from_seconds(static_cast<double>(reports) / settings_.rate_hz));
  const bool is_marked = relay_.is_needed(now) && next_sequence_ % spacing == 0;
  sent_.push_back(now);
  while (sent_.front() <= now - kMaxEchoAge) sent_.pop_front();
  OutgoingPeerMessage message{.report = report,
                              .sent = now,
                              .session = own_session(),
                              .sequence = next_sequence_++,
                              .mark = is_marked ? spacing : 0,
                              .echoes = {}};
  for (const auto& [id, peer] : peers_) {
    for (const std::optional<Session>* known : {&peer.live, &peer.candidate}) {
      const auto packet = *known ? (*known)->clock.fastest_recent_packet() : std::nullopt;
      if (!packet || packet->arrival > now || packet->arrival <= now - kEchoAge) continue;
      message.echoes.push_back({.peer = id,
                                .sent_code = echo_code(to_ns(packet->sent)),
                                .received_ns = to_ns(packet->arrival),
                                .loss = (*known)->loss.share(),
                                .is_direct = relay_.is_heard(id, now)});
    }
  }
  const std::size_t overhead =
      (seal ? PacketSeal::kOverhead : 0) + (signer ? PacketSigner::kOverhead : 0);
  EncodedPeerMessage encoded = encode_peer_message(message, limits(now, overhead, message.mark));
  if (signer) encoded.bytes = signer->sign(encoded.bytes);
  if (seal) encoded.bytes = seal->seal(encoded.bytes);
  const auto count = [&](MeshCounter counter, std::size_t n) {
    if (n > 0) counters_.add(counter, n);
  };
  count(MeshCounter::kSent, 1);
  count(MeshCounter::kSentBytes, encoded.bytes.size());
  count(MeshCounter::kLeftOutOfDatagrams, encoded.left_out);
  count(MeshCounter::kLeftOutCopies, encoded.left_out_copies);
  count(MeshCounter::kLeftOutSamples, encoded.left_out_samples);
  count(MeshCounter::kRefusedToSend, encoded.refused);
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
    heard.back().lost += session->loss.lost();
    heard.back().age_s = to_seconds(now - session->last_arrival);
    heard.back().loss = session->loss.share();
  }
  return heard;
}

}  // namespace crepes
