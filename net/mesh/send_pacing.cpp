#include "net/mesh/send_pacing.hpp"

#include <algorithm>
#include <cmath>

#include "net/mesh/peer_message.hpp"

namespace crepes {

std::size_t copies_for(double loss) {
  constexpr double kAllLost = 1.0 / 500;
  constexpr double kLeast = 2.0;
  constexpr double kMost = 6.0;
  const double p = std::clamp(loss, 1e-9, 0.99);
  return static_cast<std::size_t>(
      std::clamp(std::ceil(std::log(kAllLost) / std::log(p)), kLeast, kMost));
}

std::size_t datagram_bytes(const SendSettings& settings, std::size_t neighbors) {
  constexpr double kOwn = 9500.0;         // B/s
  constexpr double kPerNeighbor = 100.0;  // B/s
  const auto n = static_cast<double>(neighbors);
  const double share = settings.air_kbps * 1000 / 8 / (n + 1);
  const double bytes = std::min(share, kOwn + kPerNeighbor * n) / settings.rate_hz;
  return static_cast<std::size_t>(std::clamp(bytes, static_cast<double>(kMinPeerMessage),
                                             static_cast<double>(kMaxPeerMessage)));
}

double airtime(double datagrams_per_s, double bytes_per_datagram, double rate_mbps) {
  constexpr double kHeaders = 8 + 20 + 14 + 14 + 8 + 24 + 4;  // UDP IP Ethernet batman LLC MAC FCS
  constexpr double kPreamble = 20.0;                          // us
  constexpr double kSymbol = 4.0;                             // us
  constexpr double kServiceAndTailBits = 16 + 6;
  constexpr double kDifsAndMeanBackoff = 34.0 + 7.5 * 9.0;  // us
  constexpr double kRepeats = 3.0;
  const double bits = 8 * (kHeaders + bytes_per_datagram) + kServiceAndTailBits;
  const double symbols = std::ceil(bits / (rate_mbps * kSymbol));
  const double frame_us = kDifsAndMeanBackoff + kPreamble + symbols * kSymbol;
  return 1e-6 * frame_us * kRepeats * datagrams_per_s;
}

AirShare air_share(const AirTotals& before, const AirTotals& after, double rate_mbps) {
  const double dt = to_seconds(after.at - before.at);
  const auto difference = [](std::uint64_t from, std::uint64_t to) {
    return to > from ? static_cast<double>(to - from) : 0.0;
  };
  const auto share = [&](double datagrams, double bytes, double unheard) {
    if (dt <= 0 || datagrams <= 0) return 0.0;
    return airtime((datagrams + unheard) / dt, bytes / datagrams, rate_mbps);
  };
  const double own = share(difference(before.sent, after.sent),
                           difference(before.sent_bytes, after.sent_bytes), 0.0);
  const double theirs = share(difference(before.received, after.received),
                              difference(before.received_bytes, after.received_bytes),
                              difference(before.lost, after.lost));
  return {own, own + theirs};
}

}  // namespace crepes
