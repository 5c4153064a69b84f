#include "estimator/vision/tracking/track_pairing.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace crepes {
namespace {

constexpr double kMergePx = 3.0;        // beside the blobs' own radii
constexpr double kNewSources = 0.1;     // a frame and steradian
constexpr double kNewness = 2.0;        // a track of a few frames may have been a flicker
constexpr double kLeastBenefit = 1e-3;  // what lies within the gate is not left alone

}  // namespace

/// A pair's benefit is the log likelihood of finding the track there and lit, against a new source
/// there and the track dark:
///   ln p / (1 - p)  -  d^2 / 2 s^2  -  ln 2 pi s^2 n,   n new sources a steradian.
const TrackPairing::Pairs& TrackPairing::pair(std::span<const LightTrack> tracks,
                                              std::span<const LightSighting> sightings,
                                              const IdDecoder& decoder, double gate_px) {
  benefits_.clear();
  for (std::size_t t = 0; t < tracks.size(); ++t) {
    const LightTrack& track = tracks[t];
    const double gate = track.gate_rad(gate_px);
    const double lit = decoder.lit_probability(track.evidence, track.exposed).value_or(kUnknownLit);
    const double log_odds = std::log(lit / (1.0 - lit));
    const double newness = track.is_new() ? kNewness : 0.0;
    const auto first = std::partition_point(sightings.begin(), sightings.end(),
                                            [&](const LightSighting& sighting) {
                                              return sighting.u_B.x() < track.light.u_B.x() - gate;
                                            });
    for (auto it = first; it != sightings.end() && it->u_B.x() <= track.light.u_B.x() + gate;
         ++it) {
      const double d2 = squared_chord(track.light.u_B, it->u_B);
      if (d2 > gate * gate) continue;
      // A pixel's worth of model error: maneuvers, and centers that shift as LEDs come and go.
      const double variance = track.light.variance + it->px_rad * it->px_rad;
      const double density = std::log(2.0 * std::numbers::pi * variance * kNewSources);
      benefits_.push_back(
          {t, static_cast<std::size_t>(it - sightings.begin()),
           std::max(kLeastBenefit, log_odds - 0.5 * d2 / variance - density - newness)});
    }
  }
  return assignment_.solve(tracks.size(), sightings.size(), benefits_);
}

bool hides_another(std::size_t track, std::span<const LightTrack> tracks,
                   std::span<const LightSighting> sightings, const TrackPairing::Pairs& sighting_of,
                   const IdDecoder& decoder) {
  const LightSighting& sighting = sightings[*sighting_of[track]];
  for (std::size_t t = 0; t < tracks.size(); ++t) {
    const LightTrack& other = tracks[t];
    const bool is_established = !other.is_new() && other.unseen <= decoder.longest_dark();
    if (t == track || sighting_of[t] || !is_established) continue;
    const double lit = decoder.lit_probability(other.evidence, other.exposed).value_or(1.0);
    const double reach = other.seen.radius_rad + sighting.radius_rad + kMergePx * sighting.px_rad;
    if (lit > kLeastLit && squared_chord(other.light.u_B, sighting.u_B) < reach * reach)
      return true;
  }
  return false;
}

}  // namespace crepes
