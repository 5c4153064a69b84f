#include "net/mesh/peer_link.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

constexpr Duration kForwardedAge = std::chrono::seconds{1};
constexpr std::size_t kMarkedCopies = 2;

Report to_local(const PeerReport& theirs, const ClockOffset& clock) {
  Report ours;
  ours.sender = theirs.sender;
  ours.stamp = clock.to_local(theirs.stamp);
  ours.tilt = {clock.to_local(theirs.tilt.stamp), theirs.tilt.up_B, theirs.tilt.sigma_rad};
  for (const auto& [stamp, gyro, accel] : theirs.imu)
    ours.imu.push_back({clock.to_local(stamp), gyro, accel});
  for (const auto& z : theirs.bearings) {
    ours.bearings.push_back(
        {clock.to_local(z.stamp), z.neighbor, z.u_B, z.p_B_C, z.sigma_rad, z.how});
  }
  for (const auto& [stamp, neighbor, range, first_path, received] : theirs.ranges)
    ours.ranges.push_back({clock.to_local(stamp), neighbor, range, first_path, received});
  for (const auto& [stamp, neighbor, T_B_N, v_B_N] : theirs.estimates)
    ours.estimates.push_back({clock.to_local(stamp), neighbor, T_B_N, v_B_N});
  return ours;
}

constexpr auto kCounterOf = [](auto error) { return counter_of(error); };

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
    : self_(self), settings_(settings), sessions_(self) {
  set_members(members);
}

void PeerLink::set_pacing(const SendSettings& settings) {
  const std::uint64_t salt = settings_.session_salt;
  settings_ = settings;
  settings_.session_salt = salt;
}

std::optional<ReceivedReport> PeerLink::receive(std::span<const std::uint8_t> datagram,
                                                Timestamp arrival,
                                                const std::optional<PacketSeal>& seal,
                                                const Endpoint& from) {
  auto message = open(datagram, arrival, seal, from);
  if (!message) return std::nullopt;
  const RobotId sender = message->report.sender;
  const auto accepted = sessions_.accept(*message, arrival, from);
  if (trust_.keys.contains(sender)) {
    accepted && accepted->is_live ? limiter_.count_accepted(from, sender, arrival)
                                  : limiter_.count_in_vain(from, sender, arrival);
  }
  if (!accepted) return std::nullopt;
  if (accepted->is_live && message->mark > 0)
    sessions_.relay().offer({sender, message->session, message->sequence}, datagram, from, arrival);
  PeerSessions::Session& session = *accepted->session;
  if (!session.clock.is_usable()) {
    count(MeshCounter::kHeldClockUnknown);
    return std::nullopt;
  }
  session.redundancy.remove_repeated(message->report);
  return ReceivedReport{to_local(message->report, session.clock),
                        session.clock.estimate()->sigma_s};
}

/// Reads and counts a datagram of a peer; empty if it is our own or refused.
std::optional<PeerMessage> PeerLink::open(std::span<const std::uint8_t> datagram, Timestamp arrival,
                                          const std::optional<PacketSeal>& seal,
                                          const Endpoint& from) {
  const auto plain = unsealed(datagram, seal);
  const auto header =
      plain ? decode_peer_header(*plain).map_error(kCounterOf) : tl::unexpected(plain.error());
  if (header && is_our_own(*header)) {
    if (is_back(*header, from)) count_received(datagram.size(), MeshCounter::kReceivedAgain);
    return std::nullopt;
  }
  auto message = header.and_then([&](const PeerHeader&) { return read(*plain, arrival, from); });
  if (message && message->report.sender == self_) {
    if (trust_.keys.contains(self_)) limiter_.count_in_vain(from, self_, arrival);
    sessions_.count_doubled(MeshCounter::kRefusedOwnId, self_, arrival);
    return std::nullopt;
  }
  if (message) {
    count_received(datagram.size());
    return std::move(*message);
  }
  count_received(datagram.size(), message.error());
  return std::nullopt;
}

void PeerLink::count_received(std::size_t bytes, std::optional<MeshCounter> refusal) {
  count(MeshCounter::kReceived);
  count(MeshCounter::kReceivedBytes, bytes);
  if (refusal) count(*refusal);
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
  if (sender != self_ && !sessions_.knows(sender)) return MeshCounter::kRefusedUnknownSender;
  return std::nullopt;
}

/// Cheap checks first: to verify a signature is by far the most expensive one.
std::optional<MeshCounter> PeerLink::refusal_of(std::span<const std::uint8_t> plain,
                                                const PeerHeader& header, Timestamp arrival,
                                                const Endpoint& from) {
  if (const auto refusal = refusal_of(header.sender)) return refusal;
  const auto key = trust_.keys.find(header.sender);
  if (key == trust_.keys.end()) return std::nullopt;
  if (const auto refusal = sessions_.refusal_of(header, arrival, from)) return refusal;
  if (!limiter_.allows(from, header.sender, arrival))
    return MeshCounter::kRefusedSignatureUnchecked;
  if (is_authentic(plain, key->second)) return std::nullopt;
  limiter_.count_in_vain(from, header.sender, arrival);
  return MeshCounter::kRefusedSignatureWrong;
}

bool PeerLink::is_our_own(const PeerHeader& header) const {
  return header.sender == self_ && first_sent_ && header.session == own_session();
}

/// Whether a neighbor forwarded a datagram of ours. It is on the air like any other. Sockets return
/// what they broadcast, too: that is not.
bool PeerLink::is_back(const PeerHeader& header, const Endpoint& from) const {
  return sessions_.sent().is_marked(header.sequence) && sessions_.relay().is_neighbor(from);
}

/// Differs from start to start, because the clock has advanced or the machine has restarted, and
/// with the salt.
std::uint64_t PeerLink::own_session() const {
  return settings_.session_salt ^ static_cast<std::uint64_t>(to_ns(*first_sent_));
}

Pace PeerLink::pace(Timestamp now) const {
  return pace_of(settings_, sessions_.heard_directly(now), forwarded_air(now));
}

/// Share of the channel's time that forwarding took in the last second.
double PeerLink::forwarded_air(Timestamp now) const {
  double air_s = 0.0;
  for (const auto& [at, bytes] : forwarded_) {
    if (now - at < kForwardedAge)
      air_s += airtime(1.0, static_cast<double>(bytes), settings_.broadcasts);
  }
  return air_s / to_seconds(kForwardedAge);
}

std::vector<std::vector<std::uint8_t>> PeerLink::forwards(Timestamp now) {
  while (!forwarded_.empty() && now - forwarded_.front().first >= kForwardedAge)
    forwarded_.pop_front();
  const double most = forwarding_part(settings_, sessions_.heard_directly(now));
  std::vector<std::vector<std::uint8_t>> due = sessions_.relay().take_due(now);
  std::erase_if(due, [&](const auto& bytes) {
    if (forwarded_air(now) >= most) return true;
    forwarded_.emplace_back(now, bytes.size());
    count(MeshCounter::kForwarded);
    count(MeshCounter::kForwardedBytes, bytes.size());
    return false;
  });
  return due;
}

bool PeerLink::is_due(Timestamp now) const {
  constexpr double kEarliest = 0.5;  // reports: their times jitter
  const auto last = sessions_.sent().last();
  if (!last) return true;
  const double reports = static_cast<double>(pace(now).reports) - kEarliest;
  return now - *last >= from_seconds(reports / settings_.rate_hz);
}

/// A marked datagram stands for all since the last marked one. With `mark` 0: without the mark.
WireLimits PeerLink::limits(Timestamp now, std::size_t overhead, std::uint32_t mark) const {
  const Pace pace = this->pace(now);
  const std::size_t reports = pace.reports * std::max<std::size_t>(mark, 1);
  const std::size_t most = bytes_of(pace, mark > 0, sessions_.relay().is_needed(now));
  const std::size_t copies =
      mark > 0 ? kMarkedCopies : copies_for(sessions_.worst_loss_of_ours(now));
  return {.bytes = std::clamp(most, kMinPeerMessage + overhead, kMaxPeerMessage) - overhead,
          .copies = copies,
          .period = from_seconds(static_cast<double>(reports) / settings_.rate_hz),
          .reports = reports,
          .gyro_step_radps = settings_.gyro_step_radps,
          .accel_step_mps2 = settings_.accel_step_mps2,
          .samples_sent = samples_sent(copies)};
}

/// The newest inertial sample that so many datagrams could carry.
Timestamp PeerLink::samples_sent(std::size_t copies) const {
  const std::size_t sent = newest_samples_.size();
  return sent < copies ? Timestamp::max() : newest_samples_[sent - copies];
}

std::vector<std::uint8_t> PeerLink::compose(const Report& report, Timestamp now,
                                            const std::optional<PacketSeal>& seal,
                                            const std::optional<PacketSigner>& signer) {
  CREPES_EXPECT(report.sender == self_, "a robot reports for itself");
  if (!first_sent_) first_sent_ = now;
  const std::size_t reports = pace(now).reports;
  const std::uint32_t spacing = mark_spacing(reports);
  sessions_.relay().set_period(from_seconds(static_cast<double>(reports) / settings_.rate_hz));
  const bool is_marked = sessions_.relay().is_needed(now) && next_sequence_ % spacing == 0;
  sessions_.record_sent(now, next_sequence_, is_marked);
  const OutgoingPeerMessage message{.report = report,
                                    .sent = now,
                                    .session = own_session(),
                                    .sequence = next_sequence_++,
                                    .mark = is_marked ? spacing : 0,
                                    .echoes = sessions_.echoes(now)};
  const std::size_t overhead =
      (seal ? PacketSeal::kOverhead : 0) + (signer ? PacketSigner::kOverhead : 0);
  EncodedPeerMessage encoded = encode_peer_message(message, limits(now, overhead, message.mark));
  if (!report.imu.empty())
    newest_samples_.push_back(std::ranges::max(report.imu, {}, &ImuSample::stamp).stamp);
  if (newest_samples_.size() > kMostCopies) newest_samples_.pop_front();
  if (signer) encoded.bytes = signer->sign(encoded.bytes);
  if (seal) encoded.bytes = seal->seal(encoded.bytes);
  count(MeshCounter::kSent);
  count(MeshCounter::kSentBytes, encoded.bytes.size());
  count(MeshCounter::kLeftOutOfDatagrams, encoded.left_out);
  count(MeshCounter::kLeftOutCopies, encoded.left_out_copies);
  count(MeshCounter::kLeftOutSamples, encoded.left_out_samples);
  count(MeshCounter::kRefusedToSend, encoded.refused);
  return std::move(encoded.bytes);
}

AirTotals PeerLink::air_totals(Timestamp now) const {
  AirTotals totals{
      .at = now,
      .sent = counters()[MeshCounter::kSent] + counters()[MeshCounter::kForwarded],
      .sent_bytes = counters()[MeshCounter::kSentBytes] + counters()[MeshCounter::kForwardedBytes],
      .received = counters()[MeshCounter::kReceived],
      .received_bytes = counters()[MeshCounter::kReceivedBytes],
      .lost = 0,
      .of_peers = {}};
  for (const PeerTraffic& traffic : sessions_.traffic(now)) {
    totals.lost += traffic.lost;
    totals.of_peers[traffic.peer] = traffic.received + traffic.lost;
  }
  return totals;
}

}  // namespace crepes
