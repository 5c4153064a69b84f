#include "estimator/vision/blink_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace crepes {
namespace {

constexpr std::size_t kMaxTracks = 512;
constexpr int kEstablishedHits = 5;
constexpr double kGateSigmas = 4.0;
constexpr double kMergePx = 3.0;            // beside the blobs' own radii
constexpr double kMinLitProbability = 0.3;  // below it, the board is dark
constexpr double kLitProbability = 0.8;     // of a track whose code is unknown
constexpr double kNewSources = 0.1;         // a frame and steradian
constexpr double kNewness = 2.0;            // a track of a few frames may have been a flicker
constexpr Duration kLongestAbsence = std::chrono::milliseconds{600};  // the gyro carries a track
constexpr double kSteadyGain = 0.1;
constexpr double kExpectedPx = 5.0;  // so near its prediction a light is after a short absence
constexpr Duration kShortAbsence = std::chrono::milliseconds{100};
constexpr double kLeastBenefit = 1e-3;  // what lies within the gate is not left alone

// Of the direction of a board whose robot has a pose.
constexpr double kMountingSigma = 0.01;      // m
constexpr double kCameraSigma = 0.004;       // rad
constexpr double kSpeedSigma = 0.5;          // m/s
constexpr double kMostExpectedSigma = 0.04;  // rad; less certain, it says little
constexpr double kExpectedReach = 3.0;       // sigmas; other lights so near make it ambiguous
constexpr Duration kOldestPhase = std::chrono::seconds{30};

/// Squared chord, which is the squared angle for directions that are near.
double distance2(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return (a - b).squaredNorm();
}

}  // namespace

BlinkTracker::BlinkTracker(const CameraCalibration& camera, CameraModel model,
                           const VisionConfig& config, const IdLibrary& library,
                           std::optional<RobotId> own)
    : config_(config),
      model_(std::move(model)),
      T_B_C_(camera.T_cam_imu.inverse()),
      T_C_B_(camera.T_cam_imu),
      timeshift_(from_seconds(camera.timeshift_cam_imu)),
      row_delay_s_(1e-6 * camera.rolling_shutter_us_per_row),
      decoder_(library, config, camera.rate_hz, own) {
  period_ = from_seconds(1.0 / camera.rate_hz);
  timeout_ = std::max(from_seconds(config.track_timeout_ms * 1e-3), decoder_.longest_dark());
  for (const auto& [id, code] : library.entries()) counts_.decodes[id] = 0;
}

void BlinkTracker::add_imu(const ImuSample& sample) {
  if (!imu_.push(sample)) ++counts_.refused_imu;
}

std::vector<Bearing> BlinkTracker::step(const SpotFrame& frame,
                                        std::span<const ExpectedBoard> expected) {
  const Timestamp stamp = frame.stamp + timeshift_;
  confirmed_.clear();
  if (now_ && stamp <= *now_) {
    ++counts_.refused_frames;
    return {};
  }
  // A frame that was lost shows nothing, not even darkness.
  const Duration looked = now_ ? std::min(stamp - *now_, 3 * period_ / 2) : Duration{};
  expect(expected, stamp);
  predict(stamp);
  unproject(frame, stamp);
  const Pairing& sighting_of = assign();

  std::vector<Bearing> bearings;
  unclear_.clear();
  is_taken_.assign(sightings_.size(), false);
  is_known_.assign(sightings_.size(), false);
  for (std::size_t t = 0; t < tracks_.size(); ++t)
    if (sighting_of[t] && tracks_[t].evidence.assigned) is_known_[*sighting_of[t]] = true;
  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    if (!sighting_of[t]) continue;
    Track& track = tracks_[t];
    const Sighting& sighting = sightings_[*sighting_of[t]];
    is_taken_[*sighting_of[t]] = true;
    if (hides_another(t, sighting_of)) {
      ++counts_.merged_spots;
      unclear_.push_back(*sighting_of[t]);
      track.last_seen = stamp;
      track.seen_B = track.light.u_B;
      track.unseen = {};
      track.is_ambiguous = true;
      continue;
    }
    observe(track, sighting, stamp);
    name(track, stamp, bearings);
  }
  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    if (sighting_of[t]) continue;
    tracks_[t].unseen += looked;
    if (is_hidden(tracks_[t])) {
      tracks_[t].is_ambiguous = true;
    } else {
      observe_absence(tracks_[t]);
    }
  }
  retire(stamp);
  for (std::size_t s = 0; s < sightings_.size(); ++s)
    if (!is_taken_[s]) begin(sightings_[s], stamp, bearings);

  std::stable_sort(bearings.begin(), bearings.end(),
                   [](const Bearing& a, const Bearing& b) { return a.neighbor < b.neighbor; });
  return bearings;
}

/// The middle of the exposure of a row. The stamp is that of the middle row.
Timestamp BlinkTracker::exposure_of(double v_px, Timestamp stamp) const {
  return stamp + from_seconds(row_delay_s_ * (v_px - 0.5 * (model_.height() - 1)));
}

Timestamp BlinkTracker::exposure_of(const Track& track, Timestamp stamp) const {
  if (row_delay_s_ == 0.0) return stamp;
  const auto uv = model_.project(T_C_B_.q * track.light.u_B);
  return uv && model_.contains(*uv) ? exposure_of(uv->y(), stamp) : stamp;
}

/// Directions in the body at `stamp`:  u = R_B(stamp)_B(exposed) u_B(exposed).
void BlinkTracker::unproject(const SpotFrame& frame, Timestamp stamp) {
  sightings_.clear();
  for (const Spot& spot : frame.spots) {
    CameraModel::UnprojectionJacobian J;
    const auto u_C = model_.unproject({spot.u_px, spot.v_px}, &J);
    if (!u_C || !(spot.area_px2 >= 0.0) || !std::isfinite(spot.area_px2) ||
        sightings_.size() >= static_cast<std::size_t>(config_.max_spots)) {
      ++counts_.refused_spots;
      continue;
    }
    const double px_rad = std::sqrt(0.5 * J.squaredNorm());
    sightings_.push_back({.u_B = T_B_C_.q * *u_C,
                          .radius_rad = std::sqrt(spot.area_px2 / std::numbers::pi) * px_rad,
                          .px_rad = px_rad,
                          .peak = spot.peak,
                          .exposed = exposure_of(spot.v_px, stamp)});
    Sighting& sighting = sightings_.back();
    if (row_delay_s_ != 0.0 && !imu_.empty())
      sighting.u_B = imu_.rotation(stamp, sighting.exposed) * sighting.u_B;
  }
  // Not the order of the file but of the world: ties are broken alike for every order of spots.
  std::sort(sightings_.begin(), sightings_.end(), [](const Sighting& a, const Sighting& b) {
    return std::lexicographical_compare(a.u_B.begin(), a.u_B.end(), b.u_B.begin(), b.u_B.end());
  });
}

void BlinkTracker::predict(Timestamp stamp) {
  if (!now_) now_ = stamp;
  const Eigen::Quaterniond R_now_before =
      imu_.empty() ? Eigen::Quaterniond::Identity() : imu_.rotation(stamp, *now_);
  const double dt_s = to_seconds(stamp - *now_);
  hidden_.rotate_frame(R_now_before);
  for (Track& track : tracks_) {
    track.light.predict(R_now_before, dt_s);
    track.seen_B = R_now_before * track.seen_B;
    track.steady_B = R_now_before * track.steady_B;
    const Duration absence = stamp - track.last_seen;
    if (absence > decoder_.longest_dark()) {  // a rate of a few frames would carry it astray
      const ExpectedLight* expected = expected_of(track);
      track.light.u_B = expected != nullptr
                            ? expected->u_B
                            : (track.seen_B + to_seconds(absence) * track.steady_B).normalized();
    }
    track.exposed = exposure_of(track, stamp);
  }
  now_ = stamp;
}

/// Whether a light with this code was seen within its dark times.
bool BlinkTracker::is_in_sight(std::size_t code) const {
  return std::ranges::any_of(tracks_, [&](const Track& track) {
    return track.evidence.assigned && track.evidence.assigned->code == code &&
           track.unseen <= decoder_.longest_dark();
  });
}

/// The boards out of sight whose phase is known. The pose is some 20 ms old.
void BlinkTracker::expect(std::span<const ExpectedBoard> boards, Timestamp stamp) {
  expected_.clear();
  for (const ExpectedBoard& board : boards) {
    const auto code = decoder_.code_of(board.robot);
    const auto phase = code ? phases_.of(*code) : std::nullopt;
    if (!phase || stamp - phase->learned > kOldestPhase || imu_.empty() || is_in_sight(*code))
      continue;
    const double dt = to_seconds(stamp - board.stamp);
    const Eigen::Vector3d p_C_M = board.p_B_M + dt * board.v_B_M - T_B_C_.p;
    const double distance_m = p_C_M.norm();
    const Eigen::Vector3d u_B = p_C_M / distance_m;
    const double across_m2 = board.covariance_m2.trace() - u_B.dot(board.covariance_m2 * u_B);
    const double sigma_m =
        std::sqrt(across_m2 + kMountingSigma * kMountingSigma + std::pow(kSpeedSigma * dt, 2));
    const double sigma_rad = std::hypot(sigma_m / distance_m, kCameraSigma);
    if (!(sigma_rad < kMostExpectedSigma)) continue;
    expected_.push_back({.match = {*code, phase->phase},
                         .phase_learned = phase->learned,
                         .u_B = imu_.rotation(stamp, board.stamp) * u_B,
                         .sigma_rad = sigma_rad});
  }
}

/// Where the track's board is expected by pose, if that is about where it was seen: a mirror image
/// of the board is elsewhere.
const ExpectedLight* BlinkTracker::expected_of(const Track& track) const {
  if (!track.evidence.assigned) return nullptr;
  const auto found = std::ranges::find_if(expected_, [&](const ExpectedLight& light) {
    const double reach = kExpectedReach * kMostExpectedSigma;
    return light.match.code == track.evidence.assigned->code &&
           distance2(light.u_B, track.seen_B) < reach * reach;
  });
  return found == expected_.end() ? nullptr : &*found;
}

/// Whether no other light of unknown ID is within `reach_rad` of `u_B`.
bool BlinkTracker::is_alone(const Sighting& sighting, const Eigen::Vector3d& u_B,
                            double reach_rad) const {
  for (std::size_t s = 0; s < sightings_.size(); ++s) {
    if (&sightings_[s] == &sighting || is_known_[s]) continue;
    if (distance2(sightings_[s].u_B, u_B) < reach_rad * reach_rad) return false;
  }
  return true;
}

double BlinkTracker::gate_of(const Track& track) const {
  return config_.gate_px * track.seen.px_rad + track.seen.radius_rad +
         std::min(kGateSigmas * std::sqrt(track.light.variance),
                  2.0 * config_.gate_px * track.seen.px_rad);
}

/// The pairing of the greatest likelihood. A pair's benefit is the log likelihood of finding the
/// track there and lit, against a new source there and the track dark:
///   ln p / (1 - p)  -  d^2 / 2 s^2  -  ln 2 pi s^2 n,   n new sources a steradian.
const BlinkTracker::Pairing& BlinkTracker::assign() {
  pairs_.clear();
  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    const Track& track = tracks_[t];
    const double gate = gate_of(track);
    const double lit =
        decoder_.lit_probability(track.evidence, track.exposed).value_or(kLitProbability);
    const double log_odds = std::log(lit / (1.0 - lit));
    const double newness = track.hits < kEstablishedHits ? kNewness : 0.0;
    const auto first = std::partition_point(
        sightings_.begin(), sightings_.end(),
        [&](const Sighting& sighting) { return sighting.u_B.x() < track.light.u_B.x() - gate; });
    for (auto it = first; it != sightings_.end() && it->u_B.x() <= track.light.u_B.x() + gate;
         ++it) {
      const double d2 = distance2(track.light.u_B, it->u_B);
      if (d2 > gate * gate) continue;
      // A pixel's worth of model error: maneuvers, and centers that shift as LEDs come and go.
      const double variance = track.light.variance + it->px_rad * it->px_rad;
      const double density = std::log(2.0 * std::numbers::pi * variance * kNewSources);
      pairs_.push_back(
          {t, static_cast<std::size_t>(it - sightings_.begin()),
           std::max(kLeastBenefit, log_odds - 0.5 * d2 / variance - density - newness)});
    }
  }
  return assignment_.solve(tracks_.size(), sightings_.size(), pairs_);
}

bool BlinkTracker::is_established(const Track& track) const {
  return track.hits >= kEstablishedHits && track.unseen <= decoder_.longest_dark();
}

/// Whether another board that may well be lit has no spot of its own but could be in this one.
bool BlinkTracker::hides_another(std::size_t track, const Pairing& sighting_of) const {
  const Sighting& sighting = sightings_[*sighting_of[track]];
  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    const Track& other = tracks_[t];
    if (t == track || sighting_of[t] || !is_established(other)) continue;
    const double lit = decoder_.lit_probability(other.evidence, other.exposed).value_or(1.0);
    const double reach = other.seen.radius_rad + sighting.radius_rad + kMergePx * sighting.px_rad;
    if (lit > kMinLitProbability && distance2(other.light.u_B, sighting.u_B) < reach * reach)
      return true;
  }
  return false;
}

/// Whether it may be one of two boards in one spot.
bool BlinkTracker::is_hidden(const Track& track) const {
  return std::any_of(unclear_.begin(), unclear_.end(), [&](std::size_t s) {
    const double reach = gate_of(track) + sightings_[s].radius_rad;
    return distance2(sightings_[s].u_B, track.light.u_B) < reach * reach;
  });
}

/// Whether what is seen after an absence is not what was: it could be either of two, or it is not
/// where the gyro and its own motion have carried it.
bool BlinkTracker::is_another(const Track& track, const Sighting& sighting, Timestamp stamp) const {
  const auto& last_lit = track.evidence.last_lit;
  if (!last_lit || stamp - *last_lit <= decoder_.longest_dark()) return false;
  const double absence = to_seconds(stamp - *last_lit) / to_seconds(kShortAbsence);
  const double reach = kExpectedPx * std::max(1.0, absence) * sighting.px_rad;
  return track.is_ambiguous || distance2(track.light.u_B, sighting.u_B) > reach * reach;
}

void BlinkTracker::observe(Track& track, const Sighting& sighting, Timestamp stamp) {
  const bool was_assigned = track.evidence.assigned.has_value();
  if (was_assigned && is_another(track, sighting, stamp)) track.evidence.forget();
  track.light.correct(sighting.u_B, sighting.px_rad, config_.bearing_sigma_px, track.hits);
  track.steady_B +=
      std::max(kSteadyGain, 1.0 / (track.hits + 1)) * (track.light.rate_B - track.steady_B);
  track.seen_B = track.light.u_B;
  track.seen = sighting;
  track.last_seen = stamp;
  track.unseen = {};
  track.is_ambiguous = false;
  ++track.hits;

  decoder_.observe_lit(track.evidence, sighting.exposed, phases_);
  if (track.evidence.predictable_until && !is_alone(sighting, sighting.u_B, gate_of(track)))
    track.evidence.predictable_until.reset();
  decoder_.update_phase(track.evidence, sighting.exposed, phases_);
  if (!was_assigned && track.evidence.assigned)
    ++counts_.decodes[decoder_.code_id(*track.evidence.assigned)];
  if (was_assigned && !track.evidence.assigned) ++counts_.lost_ids;
}

/// Adds the bearing of a track that was seen in this frame, if it has an ID.
void BlinkTracker::name(Track& track, Timestamp stamp, std::vector<Bearing>& bearings) {
  const auto read = decoder_.id_of(track.evidence);
  const auto id = read ? read : decoder_.predicted_id(track.evidence, stamp);
  if (read && !track.predicted.empty()) {
    const bool is_same = track.predicted.front().neighbor == *read;
    ++(is_same ? counts_.predicted_ids.confirmed : counts_.predicted_ids.unconfirmed);
    for (Bearing& bearing : track.predicted) bearing.how = Naming::kRead;
    if (is_same)
      confirmed_.insert(confirmed_.end(), track.predicted.begin(), track.predicted.end());
    track.predicted.clear();
  } else if (!id && !track.evidence.predictable_until && !track.predicted.empty()) {
    ++counts_.predicted_ids.unconfirmed;
    track.predicted.clear();
  }
  // A light where its board is dark is more likely another board's that passes.
  const double lit =
      decoder_.lit_probability(track.evidence, track.seen.exposed).value_or(kLitProbability);
  if (!id || lit < kMinLitProbability) return;
  const Bearing bearing{
      .stamp = stamp,
      .neighbor = *id,
      .u_B = track.seen.u_B,
      .p_B_C = T_B_C_.p,
      .sigma_rad = track.light.sigma_px(config_.bearing_sigma_px) * track.seen.px_rad,
      .how = read ? Naming::kRead : Naming::kPredicted,
      .peak = track.seen.peak};
  bearings.push_back(bearing);
  if (!read) track.predicted.push_back(bearing);
}

void BlinkTracker::observe_absence(Track& track) const {
  const auto uv = model_.project(T_C_B_.q * track.light.u_B);
  if (uv && model_.contains(*uv)) decoder_.observe_dark(track.evidence, track.exposed);
}

void BlinkTracker::retire(Timestamp stamp) {
  std::erase_if(tracks_, [&](Track& track) {
    const Duration usual =
        track.hits < kEstablishedHits ? std::min(decoder_.longest_dark(), timeout_) : timeout_;
    const bool is_carried = track.evidence.assigned && !track.is_ambiguous;
    const Duration patience = is_carried ? std::max(usual, kLongestAbsence) : usual;
    if (track.unseen <= patience && stamp - track.last_seen <= std::max(usual, kLongestAbsence))
      return false;
    if (!track.predicted.empty()) ++counts_.predicted_ids.unconfirmed;
    keep_or_forget(track);
    return true;
  });
  hidden_.drop_old(stamp, retired_);
}

/// What was seen for a moment only says little, but for what it continues.
void BlinkTracker::keep_or_forget(Track& track) {
  const bool is_brief = track.hits < kEstablishedHits && !track.evidence.expected;
  if (!is_brief && !track.is_ambiguous && IdDecoder::is_worth_keeping(track.evidence)) {
    hidden_.add({track.seen_B, track.steady_B, track.last_seen, std::move(track.evidence)},
                retired_);
  } else {
    track.evidence.forget();
    retired_.push_back(std::move(track.evidence));
  }
}

/// Continues what was hidden, unless that board is in sight elsewhere. Without a pose its direction
/// is too uncertain for a name before it is read.
void BlinkTracker::resume(Track& track, const Sighting& sighting, Timestamp stamp) {
  auto hidden = hidden_.extract_match(sighting.u_B, stamp, expected_);
  if (!hidden) return;
  const ExpectedLight* by_pose = hidden->by_pose;
  const bool is_predictable =
      by_pose != nullptr && is_alone(sighting, by_pose->u_B, kExpectedReach * by_pose->sigma_rad);
  track.evidence = std::move(hidden->evidence);
  decoder_.resume(track.evidence, sighting.exposed, hidden->stranger);
  const auto& code = track.evidence.expected;
  const bool is_elsewhere =
      code && std::any_of(tracks_.begin(), tracks_.end(), [&](const Track& other) {
        return other.evidence.assigned && other.evidence.assigned->code == *code;
      });
  if (is_elsewhere) track.evidence.forget();
  if (!is_predictable) track.evidence.predictable_until.reset();
}

void BlinkTracker::begin(const Sighting& sighting, Timestamp stamp,
                         std::vector<Bearing>& bearings) {
  if (tracks_.size() >= kMaxTracks) {
    ++counts_.refused_spots;
    return;
  }
  Track track;
  resume(track, sighting, stamp);
  if (track.evidence.score.empty() && !retired_.empty()) {
    track.evidence = std::move(retired_.back());
    retired_.pop_back();
  }
  track.light = LightDirection::at(sighting.u_B, sighting.px_rad, config_.bearing_sigma_px);
  track.seen_B = sighting.u_B;
  track.seen = sighting;
  track.last_seen = stamp;
  track.hits = 1;
  decoder_.observe_lit(track.evidence, sighting.exposed, phases_);
  name(track, stamp, bearings);
  tracks_.push_back(std::move(track));
}

TrackerStatus BlinkTracker::status() const {
  TrackerStatus status = counts_;
  status.tracks = tracks_.size();
  for (const Track& track : tracks_)
    if (IdDecoder::is_identified(track.evidence)) ++status.identified;
  return status;
}

}  // namespace crepes
