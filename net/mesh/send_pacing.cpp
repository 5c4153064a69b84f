#include "net/mesh/send_pacing.hpp"

#include <algorithm>
#include <cmath>

namespace crepes {
namespace {

constexpr double kHeaders = 8 + 20 + 14 + 14 + 8 + 24 + 4;  // UDP IP Ethernet batman LLC MAC FCS
constexpr double kPreamble = 20.0;                          // us
constexpr double kSymbol = 4.0;                             // us
constexpr double kServiceAndTailBits = 16 + 6;
constexpr double kDifsAndMeanBackoff = 34.0 + 7.5 * 9.0;  // us

/// The longest datagram that is on the air for at most `air_s` with all its repeats. Below zero if
/// there is none.
double bytes_within(double air_s, const Broadcasts& broadcasts) {
  const double frame_us = 1e6 * air_s / broadcasts.repeats;
  const double symbols = std::floor((frame_us - kDifsAndMeanBackoff - kPreamble) / kSymbol);
  const double bits = symbols * broadcasts.rate_mbps * kSymbol - kServiceAndTailBits;
  return std::floor(bits / 8) - kHeaders;
}

}  // namespace

std::size_t copies_for(double loss) {
  constexpr double kAllLost = 1.0 / 500;
  constexpr double kLeast = 2.0;
  const double p = std::clamp(loss, 1e-9, 0.99);
  return static_cast<std::size_t>(
      std::clamp(std::ceil(std::log(kAllLost) / std::log(p)), kLeast, double{kMostCopies}));
}

Pace pace_of(const SendSettings& settings, std::size_t neighbors, double forwarded_air) {
  constexpr double kMostOfOwn = 9500.0;        // B/s
  constexpr double kMostPerNeighbor = 100.0;   // B/s
  constexpr double kWantedOfOwn = 280.0;       // B: header, echoes, inertial samples, signature
  constexpr double kWantedPerNeighbor = 13.0;  // B: a bearing and a range
  constexpr double kSlowest = 4.0;             // Hz
  const auto n = static_cast<double>(neighbors);
  const double part = settings.airtime_of_all / (n + 1);
  const double share = part - std::min(forwarded_air, forwarding_part(settings, neighbors));
  Pace pace;
  for (;; ++pace.reports) {
    const double rate_hz = settings.rate_hz / static_cast<double>(pace.reports);
    const double most = std::min((kMostOfOwn + kMostPerNeighbor * n) / rate_hz,
                                 static_cast<double>(kMaxPeerMessage));
    const double bytes = std::min(bytes_within(share / rate_hz, settings.broadcasts), most);
    pace.bytes = static_cast<std::size_t>(std::max(bytes, static_cast<double>(kMinPeerMessage)));
    const bool is_slowest = settings.rate_hz < kSlowest * static_cast<double>(pace.reports + 1);
    if (is_slowest || bytes >= std::min(kWantedOfOwn + kWantedPerNeighbor * n, most)) return pace;
  }
}

double forwarding_part(const SendSettings& settings, std::size_t neighbors) {
  constexpr double kMost = 0.75;
  return kMost * settings.airtime_of_all / static_cast<double>(neighbors + 1);
}

double airtime(double datagrams_per_s, double bytes_per_datagram, const Broadcasts& broadcasts) {
  const double bits = 8 * (kHeaders + bytes_per_datagram) + kServiceAndTailBits;
  const double symbols = std::ceil(bits / (broadcasts.rate_mbps * kSymbol));
  const double frame_us = kDifsAndMeanBackoff + kPreamble + symbols * kSymbol;
  return 1e-6 * frame_us * broadcasts.repeats * datagrams_per_s;
}

AirShare air_share(const AirTotals& before, const AirTotals& after, const Broadcasts& broadcasts) {
  const double dt = to_seconds(after.at - before.at);
  const auto difference = [](std::uint64_t from, std::uint64_t to) {
    return to > from ? static_cast<double>(to - from) : 0.0;
  };
  const auto share = [&](double datagrams, double bytes, double unheard) {
    if (dt <= 0 || datagrams <= 0) return 0.0;
    return airtime((datagrams + unheard) / dt, bytes / datagrams, broadcasts);
  };
  const double own = share(difference(before.sent, after.sent),
                           difference(before.sent_bytes, after.sent_bytes), 0.0);
  const double theirs = share(difference(before.received, after.received),
                              difference(before.received_bytes, after.received_bytes),
                              difference(before.lost, after.lost));
  AirShare shares{.own = own, .all = own + theirs, .of_peers = {}};
  const double heard = difference(before.received, after.received);
  const double bytes = difference(before.received_bytes, after.received_bytes);
  for (const auto& [peer, total] : after.of_peers) {
    const auto earlier = before.of_peers.find(peer);
    const double sent = difference(earlier == before.of_peers.end() ? 0 : earlier->second, total);
    shares.of_peers[peer] = heard > 0 ? share(sent, bytes * sent / heard, 0.0) : 0.0;
  }
  return shares;
}

}  // namespace crepes
