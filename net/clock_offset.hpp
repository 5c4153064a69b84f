/// Where a peer's clock stands against ours: offset and skew out of two-way packet times. Pure.
///
/// With o(t) the peer's clock minus ours, a packet from the peer says  o(t) >= sent - arrival  and
/// an echo of ours says  o(t) <= arrival - sent: no packet arrives before it was sent. Over a
/// sliding window the line o(t) = o0 + k t that keeps the widest margin to both sides is the
/// estimate: the fastest packets alone carry it, and its middle is right where both ways are
/// equally fast.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "estimator/core/bound_envelope.hpp"
#include "estimator/core/time.hpp"

namespace crepes {

/// The clock as it is now.
struct ClockEstimate {
  double offset_s = 0.0;  ///< peer's clock minus ours
  double skew = 0.0;      ///< rate of the offset: peer's seconds gained per second of ours
  double sigma_s = 0.0;
};

/// A packet of the peer as it arrived here.
struct PacketTimes {
  PeerTimestamp sent{};
  Timestamp arrival{};
};

class ClockOffset {
 public:
  enum class Verdict : std::uint8_t {
    kUsed,
    kImplausible,  ///< contradicts the clock as known; its stamps must not be used
    kRestarted,    ///< the last of several contradictions: the peer's clock jumped, all begins anew
  };

  /// A packet of the peer came. `arrival` must not go back.
  Verdict packet_arrived(const PacketTimes& packet);
  /// The peer says that our packet, `sent` by our clock, reached it at `arrival` by its clock;
  /// `now` is when we learn it. Repetitions are harmless.
  Verdict packet_echoed(Timestamp sent, PeerTimestamp arrival, Timestamp now);

  /// Known well enough to translate stamps (sigma below 5 ms).
  [[nodiscard]] bool is_usable() const;
  /// The clock at the last packet; empty until packets went both ways. Offset and skew are what
  /// `to_local` applies: a correction is worked in at up to 1 ms a second, not jumped to.
  [[nodiscard]] std::optional<ClockEstimate> estimate() const;
  /// Only while `estimate()` has a value, and for stamps within some hours of the last packet's.
  [[nodiscard]] Timestamp to_local(PeerTimestamp stamp) const;

  /// The fastest packet of the last half second, to be echoed to the peer.
  [[nodiscard]] std::optional<PacketTimes> fastest_recent_packet() const;

 private:
  void begin_anew();
  [[nodiscard]] bool is_plausible(double t, double low, double high) const;
  [[nodiscard]] double seconds(Timestamp t) const;
  [[nodiscard]] double offset_seconds(PeerTimestamp peer, Timestamp ours) const;
  void refit();
  void advance();

  /// The estimate's line and how sure it is, in seconds from `origin_` and `base_`.
  struct Line {
    double offset = 0.0;  ///< at `center`
    double skew = 0.0;
    double center = 0.0;
    double offset_sigma = 0.0;
    double skew_sigma = 0.0;
    [[nodiscard]] double at(double t) const { return offset + skew * (t - center); }
  };

  std::optional<Timestamp> origin_;  ///< of the first packet; zero of all times inside
  Duration base_{};  ///< offset that the first packet suggested; zero of all offsets
  double now_ = 0.0;
  BoundEnvelope lower_{+1};
  BoundEnvelope upper_{-1};
  std::optional<Line> fit_;
  double correction_ = 0.0;       ///< published minus fitted offset: not yet worked in
  double published_until_ = 0.0;  ///< time to which `correction_` decayed
  std::optional<double> usable_since_;
  std::vector<PacketTimes> recent_;  ///< arrivals of the last half second
  PacketTimes last_echo_;
  int early_packets_ = 0;  ///< contradictions in a row, by direction
  int early_echoes_ = 0;
};

}  // namespace crepes
