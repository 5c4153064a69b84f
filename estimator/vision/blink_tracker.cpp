#include "estimator/vision/blink_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace crepes {
namespace {

constexpr std::size_t kMaxTracks = 512;
constexpr int kEstablishedHits = 5;
constexpr double kRateSigma = 1.0;     // of a new track [rad/s]
constexpr double kAccelDensity = 3.0;  // of a neighbor's direction [rad/s^2/sqrt(Hz)]
constexpr double kGyroSigma = 0.02;    // what the gyro leaves of own rotation [rad/s]
constexpr double kGateSigmas = 4.0;
constexpr double kMergePx = 3.0;            // beside the blobs' own radii
constexpr double kMinLitProbability = 0.3;  // below it, an absence was to be expected

/// Squared chord, which is the squared angle for directions that are near.
double distance2(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return (a - b).squaredNorm();
}

}  // namespace

BlinkTracker::BlinkTracker(const CameraConfig& camera, const CameraModel& model,
                           const VisionConfig& config, const IdLibrary& library)
    : config_(config),
      model_(model),
      T_B_C_(camera.T_cam_imu.inverse()),
      T_C_B_(camera.T_cam_imu),
      timeshift_(from_seconds(camera.timeshift_cam_imu)),
      timeout_(from_seconds(config.track_timeout_ms * 1e-3)),
      decoder_(library, config.flip_rate, config.min_confidence) {
  for (const auto& [id, code] : library.entries()) counts_.decodes[id] = 0;
}

void BlinkTracker::add_imu(const ImuSample& sample) {
  if (!gyro_.add(sample)) ++counts_.refused_imu;
}

std::vector<Bearing> BlinkTracker::step(const SpotFrame& frame) {
  const Timestamp stamp = frame.stamp + timeshift_;
  if (now_ && stamp <= *now_) {
    ++counts_.refused_frames;
    return {};
  }
  predict(stamp);
  const std::vector<Sighting> sightings = look(frame);
  const std::vector<Pairing> pairings = assign(sightings, stamp);

  std::vector<bool> is_paired(tracks_.size(), false);
  std::vector<bool> is_taken(sightings.size(), false);
  for (const Pairing& pairing : pairings) is_paired[pairing.track] = true;
  std::vector<bool> is_unclear(tracks_.size(), false);

  std::vector<Bearing> bearings;
  for (const auto& [t, s, cost] : pairings) {
    is_taken[s] = true;
    Track& track = tracks_[t];
    const Sighting& sighting = sightings[s];
    if (hides_another(t, sighting, is_paired, stamp)) {
      ++counts_.merged_spots;
      is_unclear[t] = true;
      track.last_seen = stamp;
      continue;
    }
    observe(track, sighting, stamp);
    if (const auto id = decoder_.id_of(track.evidence)) {
      bearings.push_back({.stamp = stamp,
                          .neighbor = *id,
                          .u_B = sighting.u_B,
                          .p_B_C = T_B_C_.p,
                          .sigma_rad = config_.bearing_sigma_px * sighting.px_rad});
    }
  }
  for (std::size_t t = 0; t < is_paired.size(); ++t) {
    if (!is_paired[t]) {
      const bool is_hidden = std::any_of(pairings.begin(), pairings.end(), [&](const Pairing& p) {
        return is_unclear[p.track] &&
               distance2(sightings[p.sighting].u_B, tracks_[t].u_B) <
                   std::pow(gate_of(tracks_[t]) + sightings[p.sighting].radius_rad, 2);
      });
      if (!is_hidden) observe_absence(tracks_[t], stamp);
    }
  }
  retire(stamp);

  for (std::size_t s = 0; s < sightings.size(); ++s) {
    if (is_taken[s]) continue;
    if (tracks_.size() >= kMaxTracks) {
      ++counts_.refused_spots;
      continue;
    }
    Track track;
    track.u_B = sightings[s].u_B;
    track.variance = std::pow(config_.bearing_sigma_px * sightings[s].px_rad, 2);
    track.rate_variance = kRateSigma * kRateSigma;
    track.seen = sightings[s];
    track.last_seen = stamp;
    track.hits = 1;
    decoder_.observe_lit(track.evidence, stamp);
    tracks_.push_back(std::move(track));
  }
  std::stable_sort(bearings.begin(), bearings.end(),
                   [](const Bearing& a, const Bearing& b) { return a.neighbor < b.neighbor; });
  return bearings;
}

std::vector<BlinkTracker::Sighting> BlinkTracker::look(const SpotFrame& frame) {
  std::vector<Sighting> sightings;
  for (const Spot& spot : frame.spots) {
    CameraModel::UnprojectionJacobian J;
    const auto u_C = model_.unproject({spot.u_px, spot.v_px}, &J);
    if (!u_C || !(spot.area_px2 >= 0.0) || !std::isfinite(spot.area_px2) ||
        sightings.size() >= static_cast<std::size_t>(config_.max_spots)) {
      ++counts_.refused_spots;
      continue;
    }
    const double px_rad = std::sqrt(0.5 * J.squaredNorm());
    sightings.push_back({.u_B = T_B_C_.q * *u_C,
                         .radius_rad = std::sqrt(spot.area_px2 / std::numbers::pi) * px_rad,
                         .px_rad = px_rad});
  }
  // Not the order of the file but of the world: ties are broken alike for every order of spots.
  std::sort(sightings.begin(), sightings.end(), [](const Sighting& a, const Sighting& b) {
    return std::lexicographical_compare(a.u_B.begin(), a.u_B.end(), b.u_B.begin(), b.u_B.end());
  });
  return sightings;
}

/// Constant rate beside own rotation:  u <- R_B1_B0 (u + rate dt), white acceleration of density
/// kAccelDensity; the covariance is that of each of the two axes across u.
void BlinkTracker::predict(Timestamp stamp) {
  if (!now_) now_ = stamp;
  const Eigen::Quaterniond R_now_before = gyro_.rotation(*now_, stamp).conjugate();
  const double dt = to_seconds(stamp - *now_);
  const double q = kAccelDensity * kAccelDensity;
  for (Track& track : tracks_) {
    track.u_B = (R_now_before * (track.u_B + track.rate_B * dt)).normalized();
    track.rate_B = R_now_before * track.rate_B;
    track.variance += dt * (2.0 * track.covariance + dt * track.rate_variance) +
                      q * dt * dt * dt / 3.0 + std::pow(kGyroSigma * dt, 2);
    track.covariance += dt * track.rate_variance + q * dt * dt / 2.0;
    track.rate_variance += q * dt;
  }
  now_ = stamp;
}

double BlinkTracker::gate_of(const Track& track) const {
  return config_.gate_px * track.seen.px_rad + track.seen.radius_rad +
         std::min(kGateSigmas * std::sqrt(track.variance),
                  2.0 * config_.gate_px * track.seen.px_rad);
}

/// Greedy, the likeliest pair first. The cost is the negative log likelihood of finding the track
/// there and lit, so of two tracks the one that is surer of its place or due to be lit wins.
std::vector<BlinkTracker::Pairing> BlinkTracker::assign(const std::vector<Sighting>& sightings,
                                                        Timestamp stamp) const {
  std::vector<Pairing> candidates;
  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    const Track& track = tracks_[t];
    const double gate2 = std::pow(gate_of(track), 2);
    const double lit = decoder_.lit_probability(track.evidence, stamp).value_or(0.8);
    for (std::size_t s = 0; s < sightings.size(); ++s) {
      const double d2 = distance2(track.u_B, sightings[s].u_B);
      if (d2 > gate2) continue;
      // A pixel's worth of model error: maneuvers, and centers that shift as LEDs come and go.
      const double variance = track.variance + std::pow(sightings[s].px_rad, 2);
      const double newness = track.hits < kEstablishedHits ? 2.0 : 0.0;
      candidates.push_back({t, s,
                            0.5 * d2 / variance +
                                std::log(variance / std::pow(sightings[s].px_rad, 2)) -
                                std::log(lit) + newness});
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Pairing& a, const Pairing& b) { return a.cost < b.cost; });
  std::vector<bool> has_sighting(tracks_.size(), false);
  std::vector<bool> has_track(sightings.size(), false);
  std::vector<Pairing> pairings;
  for (const Pairing& pairing : candidates) {
    if (has_sighting[pairing.track] || has_track[pairing.sighting]) continue;
    has_sighting[pairing.track] = true;
    has_track[pairing.sighting] = true;
    pairings.push_back(pairing);
  }
  return pairings;
}

bool BlinkTracker::is_established(const Track& track, Timestamp stamp) const {
  return track.hits >= kEstablishedHits && stamp - track.last_seen <= decoder_.longest_dark();
}

/// Whether another board that may well be lit has no spot of its own but could be in this one.
bool BlinkTracker::hides_another(std::size_t track, const Sighting& sighting,
                                 const std::vector<bool>& is_paired, Timestamp stamp) const {
  for (std::size_t t = 0; t < is_paired.size(); ++t) {
    const Track& other = tracks_[t];
    if (t == track || is_paired[t] || !is_established(other, stamp)) continue;
    const double lit = decoder_.lit_probability(other.evidence, stamp).value_or(1.0);
    const double reach = other.seen.radius_rad + sighting.radius_rad + kMergePx * sighting.px_rad;
    if (lit > kMinLitProbability && distance2(other.u_B, sighting.u_B) < reach * reach) return true;
  }
  return false;
}

void BlinkTracker::observe(Track& track, const Sighting& sighting, Timestamp stamp) {
  const double noise = std::pow(config_.bearing_sigma_px * sighting.px_rad, 2);
  const double S = track.variance + noise;
  const double gain = track.variance / S;
  const double rate_gain = track.covariance / S;
  const Eigen::Vector3d residual = sighting.u_B - track.u_B;
  track.u_B = (track.u_B + gain * residual).normalized();
  track.rate_B += rate_gain * residual;
  track.rate_B -= track.u_B * track.u_B.dot(track.rate_B);
  track.rate_variance -= rate_gain * track.covariance;
  track.covariance *= 1.0 - gain;
  track.variance *= 1.0 - gain;
  track.seen = sighting;
  track.last_seen = stamp;
  ++track.hits;

  const bool was_assigned = track.evidence.assigned.has_value();
  decoder_.observe_lit(track.evidence, stamp);
  if (!was_assigned && track.evidence.assigned)
    ++counts_.decodes[decoder_.code_id(*track.evidence.assigned)];
  if (was_assigned && !track.evidence.assigned) ++counts_.lost_ids;
}

void BlinkTracker::observe_absence(Track& track, Timestamp stamp) const {
  const auto uv = model_.project(T_C_B_.q * track.u_B);
  if (uv && model_.contains(*uv)) decoder_.observe_dark(track.evidence, stamp);
}

void BlinkTracker::retire(Timestamp stamp) {
  std::erase_if(tracks_, [&](const Track& track) {
    const Duration patience =
        track.hits < kEstablishedHits ? std::min(decoder_.longest_dark(), timeout_) : timeout_;
    return stamp - track.last_seen > patience;
  });
}

TrackerStatus BlinkTracker::status() const {
  TrackerStatus status = counts_;
  status.tracks = tracks_.size();
  for (const Track& track : tracks_)
    if (IdDecoder::is_identified(track.evidence)) ++status.identified;
  return status;
}

}  // namespace crepes
