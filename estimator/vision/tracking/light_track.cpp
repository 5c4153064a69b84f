#include "estimator/vision/tracking/light_track.hpp"

#include <algorithm>
#include <cmath>

namespace crepes {
namespace {

constexpr int kEstablishedHits = 5;
constexpr double kGateSigmas = 4.0;
constexpr double kSteadyGain = 0.1;
constexpr double kExpectedPx = 5.0;  // so near its prediction a light is after a short absence
constexpr Duration kShortAbsence = std::chrono::milliseconds{100};

}  // namespace

LightTrack LightTrack::at(const LightSighting& sighting, Timestamp stamp, double sigma_px) {
  LightTrack track;
  track.light = LightDirection::at(sighting.u_B, sighting.px_rad, sigma_px);
  track.seen_B = sighting.u_B;
  track.seen = sighting;
  track.last_seen = stamp;
  track.hits = 1;
  return track;
}

void LightTrack::predict(const Eigen::Quaterniond& R_now_before, double dt_s) {
  light.predict(R_now_before, dt_s);
  seen_B = R_now_before * seen_B;
  steady_B = R_now_before * steady_B;
}

void LightTrack::extrapolate(Timestamp stamp) {
  light.u_B = (seen_B + to_seconds(stamp - last_seen) * steady_B).normalized();
}

void LightTrack::correct(const LightSighting& sighting, Timestamp stamp, double sigma_px) {
  light.correct(sighting.u_B, sighting.px_rad, sigma_px, hits);
  steady_B += std::max(kSteadyGain, 1.0 / (hits + 1)) * (light.rate_B - steady_B);
  seen_B = light.u_B;
  seen = sighting;
  last_seen = stamp;
  unseen = {};
  is_ambiguous = false;
  ++hits;
}

void LightTrack::merge(Timestamp stamp) {
  last_seen = stamp;
  seen_B = light.u_B;
  unseen = {};
  is_ambiguous = true;
}

bool LightTrack::is_new() const { return hits < kEstablishedHits; }

double LightTrack::gate_rad(double gate_px) const {
  return gate_px * seen.px_rad + seen.radius_rad +
         std::min(kGateSigmas * std::sqrt(light.variance), 2.0 * gate_px * seen.px_rad);
}

bool LightTrack::is_continued_by_another(const LightSighting& sighting, Timestamp stamp,
                                         Duration longest_dark) const {
  const auto& last_lit = evidence.last_lit;
  if (!last_lit || stamp - *last_lit <= longest_dark) return false;
  const double absence = to_seconds(stamp - *last_lit) / to_seconds(kShortAbsence);
  const double reach = kExpectedPx * std::max(1.0, absence) * sighting.px_rad;
  return is_ambiguous || squared_chord(light.u_B, sighting.u_B) > reach * reach;
}

}  // namespace crepes
