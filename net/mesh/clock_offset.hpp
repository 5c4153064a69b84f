/// Offset and skew of a peer's clock against ours, estimated from two-way packet times. Pure.
///
/// With o(t) the peer's clock minus ours, a packet from the peer says  o(t) >= sent - arrival  and
/// an echo of ours says  o(t) <= arrival - sent: no packet arrives before it was sent. The
/// estimate is the line o(t) = o0 + k t with the widest margin to both sides over a sliding window.
/// Only the fastest packets determine it. It is unbiased where both directions are equally fast.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "estimator/core/bound_envelope.hpp"
#include "estimator/core/time.hpp"

namespace crepes {

/// The current estimate.
struct ClockEstimate {
  double offset_s = 0.0;  ///< peer's clock minus ours
  double skew = 0.0;      ///< rate of the offset [s per s of our clock]
  double sigma_s = 0.0;
};

/// A packet of the peer.
struct PacketTimes {
  PeerTimestamp sent{};
  Timestamp arrival{};
};

class ClockOffset {
 public:
  /// What became of a packet.
  enum class Verdict : std::uint8_t {
    kUsed,
    kImplausible,  ///< contradicts the estimate; its stamps must not be used
    kRestarted,    ///< the last of several contradictions: the clock jumped, the estimate was reset
  };

  /// A packet arrived from the peer. `arrival` must not decrease.
  Verdict add_packet(const PacketTimes& packet);
  /// The peer echoes our packet: `sent` by our clock, received at `arrival` by the peer's clock,
  /// echo received at `now`. Repetitions are harmless.
  Verdict add_echo(Timestamp sent, PeerTimestamp arrival, Timestamp now);

  /// Accurate enough to convert stamps (sigma below 5 ms).
  [[nodiscard]] bool is_usable() const;
  /// At the last packet; empty until packets went both ways. `to_local` applies this offset and
  /// skew. For 2.5 s corrections are steps; later they are slewed at up to 1 ms a second.
  [[nodiscard]] std::optional<ClockEstimate> estimate() const;
  /// Only while `estimate()` has a value, and for stamps within a few hours of the last packet.
  [[nodiscard]] Timestamp to_local(PeerTimestamp stamp) const;

  /// The packet with the least delay in the last half second: the one to echo to the peer.
  [[nodiscard]] std::optional<PacketTimes> fastest_recent_packet() const;

 private:
  void begin_anew();
  [[nodiscard]] bool is_plausible(double t, double low, double high) const;
  [[nodiscard]] double seconds(Timestamp t) const;
  [[nodiscard]] double offset_seconds(PeerTimestamp peer, Timestamp ours) const;
  void refit();
  void advance();

  /// The estimated line and its uncertainty, in seconds from `origin_` and `base_`.
  struct Line {
    double offset = 0.0;  ///< at `center`
    double skew = 0.0;
    double center = 0.0;
    double offset_sigma = 0.0;
    double skew_sigma = 0.0;
    [[nodiscard]] double at(double t) const { return offset + skew * (t - center); }
  };

  std::optional<Timestamp> origin_;  ///< arrival of the first packet; zero of all times here
  Duration base_{};  ///< offset that the first packet suggests; zero of all offsets here
  double now_ = 0.0;
  BoundEnvelope lower_{+1};
  BoundEnvelope upper_{-1};
  std::optional<Line> fit_;
  double correction_ = 0.0;       ///< published minus fitted offset: still to be slewed
  double published_until_ = 0.0;  ///< time to which `correction_` decayed
  std::optional<double> usable_since_;
  std::vector<PacketTimes> recent_;  ///< arrivals of the last half second
  PacketTimes last_echo_;
  int early_packets_ = 0;  ///< consecutive contradictions, by direction
  int early_echoes_ = 0;
};

}  // namespace crepes
