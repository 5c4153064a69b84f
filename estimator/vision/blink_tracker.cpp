#include "estimator/vision/blink_tracker.hpp"

#include <algorithm>
#include <utility>

namespace crepes {
namespace {

constexpr std::size_t kMaxTracks = 512;
constexpr Duration kLongestAbsence = std::chrono::milliseconds{600};  // the gyro carries a track
constexpr Duration kOldestPhase = std::chrono::seconds{30};

}  // namespace

BlinkTracker::BlinkTracker(const CameraCalibration& camera, CameraModel model,
                           const VisionConfig& config, const IdLibrary& library,
                           std::optional<RobotId> own)
    : config_(config),
      view_(camera, std::move(model)),
      period_(from_seconds(1.0 / camera.rate_hz)),
      decoder_(library, config, camera.rate_hz, own) {
  timeout_ = std::max(from_seconds(config.track_timeout_ms * 1e-3), decoder_.longest_dark());
  for (const auto& [id, code] : library.entries()) counts_.decodes[id] = 0;
  sizes_ = library.sizes();
}

void BlinkTracker::add_imu(const ImuSample& sample) {
  if (!imu_.push(sample)) ++counts_.refused_imu;
}

std::vector<Bearing> BlinkTracker::step(const SpotFrame& frame,
                                        std::span<const ExpectedBoard> expected) {
  const Timestamp stamp = view_.body_time(frame.stamp);
  confirmed_.clear();
  if (now_ && stamp <= *now_) {
    ++counts_.refused_frames;
    return {};
  }
  // A frame that was lost shows nothing, not even darkness.
  const Duration looked = now_ ? std::min(stamp - *now_, 3 * period_ / 2) : Duration{};
  expect(expected, stamp);
  predict(stamp);
  counts_.refused_spots +=
      view_.unproject(frame, stamp, imu_, static_cast<std::size_t>(config_.max_spots), sightings_);
  const auto& sighting_of = pairing_.pair(tracks_, sightings_, decoder_, config_.gate_px);

  std::vector<Bearing> bearings;
  mark_known(sighting_of);
  observe_seen(sighting_of, stamp, bearings);
  observe_unseen(sighting_of, looked);
  retire(stamp);
  for (std::size_t s = 0; s < sightings_.size(); ++s)
    if (!is_taken_[s]) begin(sightings_[s], stamp, bearings);

  std::stable_sort(bearings.begin(), bearings.end(),
                   [](const Bearing& a, const Bearing& b) { return a.neighbor < b.neighbor; });
  return bearings;
}

/// The boards out of sight whose phase is known. The pose is some 20 ms old.
void BlinkTracker::expect(std::span<const ExpectedBoard> boards, Timestamp stamp) {
  expected_.clear();
  for (const ExpectedBoard& board : boards) {
    const auto code = decoder_.code_of(board.robot);
    const auto phase = code ? phases_.of(*code) : std::nullopt;
    if (!phase || stamp - phase->learned > kOldestPhase || imu_.empty() || is_in_sight(*code))
      continue;
    const auto direction = direction_of(board, view_.p_B_C(), stamp);
    if (!direction) continue;
    expected_.push_back({.match = {*code, phase->phase},
                         .phase_learned = phase->learned,
                         .u_B = imu_.rotation(stamp, board.stamp) * direction->u_B,
                         .sigma_rad = direction->sigma_rad});
  }
}

/// Whether a light with this code was seen within its dark times.
bool BlinkTracker::is_in_sight(std::size_t code) const {
  return std::ranges::any_of(tracks_, [&](const LightTrack& track) {
    return track.evidence.assigned && track.evidence.assigned->code == code &&
           track.unseen <= decoder_.longest_dark();
  });
}

void BlinkTracker::predict(Timestamp stamp) {
  if (!now_) now_ = stamp;
  const Eigen::Quaterniond R_now_before =
      imu_.empty() ? Eigen::Quaterniond::Identity() : imu_.rotation(stamp, *now_);
  const double dt_s = to_seconds(stamp - *now_);
  hidden_.rotate_frame(R_now_before);
  for (LightTrack& track : tracks_) {
    track.predict(R_now_before, dt_s);
    // A rate of a few frames would carry it astray.
    if (stamp - track.last_seen > decoder_.longest_dark()) {
      if (const ExpectedLight* expected = expected_of(track)) {
        track.light.u_B = expected->u_B;
      } else {
        track.extrapolate(stamp);
      }
    }
    track.exposed = view_.exposure_of(track.light.u_B, stamp);
  }
  now_ = stamp;
}

/// Where the track's board is expected by pose. Null without one.
const ExpectedLight* BlinkTracker::expected_of(const LightTrack& track) const {
  if (!track.evidence.assigned) return nullptr;
  return find_near(expected_, track.evidence.assigned->code, track.seen_B);
}

void BlinkTracker::mark_known(const TrackPairing::Pairs& sighting_of) {
  is_known_.assign(sightings_.size(), false);
  for (std::size_t t = 0; t < tracks_.size(); ++t)
    if (sighting_of[t] && tracks_[t].evidence.assigned) is_known_[*sighting_of[t]] = true;
}

void BlinkTracker::observe_seen(const TrackPairing::Pairs& sighting_of, Timestamp stamp,
                                std::vector<Bearing>& bearings) {
  unclear_.clear();
  is_taken_.assign(sightings_.size(), false);
  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    if (!sighting_of[t]) continue;
    LightTrack& track = tracks_[t];
    is_taken_[*sighting_of[t]] = true;
    if (hides_another(t, tracks_, sightings_, sighting_of, decoder_)) {
      ++counts_.merged_spots;
      unclear_.push_back(*sighting_of[t]);
      track.merge(stamp);
      continue;
    }
    observe(track, sightings_[*sighting_of[t]], stamp);
    name(track, stamp, bearings);
  }
}

void BlinkTracker::observe(LightTrack& track, const LightSighting& sighting, Timestamp stamp) {
  const bool was_assigned = track.evidence.assigned.has_value();
  const bool was_foreign = track.evidence.is_foreign;
  if (was_assigned && track.is_continued_by_another(sighting, stamp, decoder_.longest_dark()))
    track.evidence.forget();
  track.correct(sighting, stamp, config_.bearing_sigma_px);

  decoder_.observe_lit(track.evidence, sighting.exposed, phases_);
  if (track.evidence.predictable_until &&
      !is_alone(sighting, sighting.u_B, track.gate_rad(config_.gate_px)))
    track.evidence.predictable_until.reset();
  decoder_.update_phase(track.evidence, sighting.exposed, phases_);
  if (!was_assigned && track.evidence.assigned)
    ++counts_.decodes[decoder_.code_id(*track.evidence.assigned)];
  if (was_assigned && !track.evidence.assigned) ++counts_.lost_ids;
  if (!was_foreign && track.evidence.is_foreign) ++counts_.foreign_boards;
}

/// Whether no other light of unknown ID is within `reach_rad` of `u_B`.
bool BlinkTracker::is_alone(const LightSighting& sighting, const Eigen::Vector3d& u_B,
                            double reach_rad) const {
  for (std::size_t s = 0; s < sightings_.size(); ++s) {
    if (&sightings_[s] == &sighting || is_known_[s]) continue;
    if (squared_chord(sightings_[s].u_B, u_B) < reach_rad * reach_rad) return false;
  }
  return true;
}

/// Adds the bearing of a track that was seen in this frame, if it has an ID.
void BlinkTracker::name(LightTrack& track, Timestamp stamp, std::vector<Bearing>& bearings) {
  const auto read = decoder_.id_of(track.evidence);
  const auto id = read ? read : decoder_.predicted_id(track.evidence, stamp);
  const bool is_settled = read || (!id && !track.evidence.predictable_until);
  if (is_settled && !track.predicted.empty()) settle_predicted(track, read);
  // A light where its board is dark is more likely another board's that passes.
  const double lit =
      decoder_.lit_probability(track.evidence, track.seen.exposed).value_or(kUnknownLit);
  if (!id || lit < kLeastLit) return;
  Bearing bearing{.stamp = stamp,
                  .neighbor = *id,
                  .u_B = track.seen.u_B,
                  .p_B_C = view_.p_B_C(),
                  .sigma_rad = track.light.sigma_px(config_.bearing_sigma_px) * track.seen.px_rad,
                  .how = read ? Naming::kRead : Naming::kPredicted,
                  .peak = track.seen.peak};
  const auto size = sizes_.find(*id);
  if (size != sizes_.end() && size->second.has(track.seen.ring_leds)) {
    bearing.distance_m = size->second.ring_radius_m / track.seen.ring_tan;
    bearing.distance_sigma_m = bearing.distance_m * track.seen.ring_sigma;
  }
  bearings.push_back(bearing);
  if (!read) track.predicted.push_back(bearing);
}

/// Ends the prediction of a track's ID: it was `read`, or can no longer be.
void BlinkTracker::settle_predicted(LightTrack& track, std::optional<RobotId> read) {
  const bool is_same = read && track.predicted.front().neighbor == *read;
  ++(is_same ? counts_.predicted_ids.confirmed : counts_.predicted_ids.unconfirmed);
  if (is_same) {
    for (Bearing& bearing : track.predicted) bearing.how = Naming::kRead;
    confirmed_.insert(confirmed_.end(), track.predicted.begin(), track.predicted.end());
  }
  track.predicted.clear();
}

/// `looked`: the time for which frames could have shown the tracks since the one before.
void BlinkTracker::observe_unseen(const TrackPairing::Pairs& sighting_of, Duration looked) {
  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    if (sighting_of[t]) continue;
    LightTrack& track = tracks_[t];
    track.unseen += looked;
    if (is_hidden(track)) {
      track.is_ambiguous = true;
    } else if (view_.contains(track.light.u_B)) {
      decoder_.observe_dark(track.evidence, track.exposed);
    }
  }
}

/// Whether it may be one of two boards in one spot.
bool BlinkTracker::is_hidden(const LightTrack& track) const {
  return std::any_of(unclear_.begin(), unclear_.end(), [&](std::size_t s) {
    const double reach = track.gate_rad(config_.gate_px) + sightings_[s].radius_rad;
    return squared_chord(sightings_[s].u_B, track.light.u_B) < reach * reach;
  });
}

void BlinkTracker::retire(Timestamp stamp) {
  std::erase_if(tracks_, [&](LightTrack& track) {
    const Duration usual = track.is_new() ? std::min(decoder_.longest_dark(), timeout_) : timeout_;
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
void BlinkTracker::keep_or_forget(LightTrack& track) {
  const bool is_brief = track.is_new() && !track.evidence.expected;
  if (!is_brief && !track.is_ambiguous && IdDecoder::is_worth_keeping(track.evidence)) {
    hidden_.add({track.seen_B, track.steady_B, track.last_seen, std::move(track.evidence)},
                retired_);
  } else {
    track.evidence.forget();
    retired_.push_back(std::move(track.evidence));
  }
}

void BlinkTracker::begin(const LightSighting& sighting, Timestamp stamp,
                         std::vector<Bearing>& bearings) {
  if (tracks_.size() >= kMaxTracks) {
    ++counts_.refused_spots;
    return;
  }
  LightTrack track = LightTrack::at(sighting, stamp, config_.bearing_sigma_px);
  if (!resume(track, sighting, stamp)) track.evidence = new_evidence();
  decoder_.observe_lit(track.evidence, sighting.exposed, phases_);
  name(track, stamp, bearings);
  tracks_.push_back(std::move(track));
}

/// Evidence of nothing, in the memory of a track that has ended, if there is one.
BlinkEvidence BlinkTracker::new_evidence() {
  if (retired_.empty()) return {};
  BlinkEvidence evidence = std::move(retired_.back());
  retired_.pop_back();
  return evidence;
}

/// Continues what was hidden, unless that board is in sight elsewhere. Without a pose its direction
/// is too uncertain for a name before it is read. False if nothing was expected here.
bool BlinkTracker::resume(LightTrack& track, const LightSighting& sighting, Timestamp stamp) {
  auto hidden = hidden_.extract_match(sighting.u_B, stamp, expected_);
  if (!hidden) return false;
  const ExpectedLight* by_pose = hidden->by_pose;
  const bool is_predictable =
      by_pose != nullptr && is_alone(sighting, by_pose->u_B, by_pose->reach_rad());
  if (hidden->evidence) {
    track.evidence = std::move(*hidden->evidence);
  } else {
    track.evidence = new_evidence();
    track.evidence.assigned = by_pose->match;
    track.evidence.last_lit = by_pose->phase_learned;
  }
  decoder_.resume(track.evidence, sighting.exposed, hidden->stranger);
  const auto& code = track.evidence.expected;
  const bool is_elsewhere =
      code && std::any_of(tracks_.begin(), tracks_.end(), [&](const LightTrack& other) {
        return other.evidence.assigned && other.evidence.assigned->code == *code;
      });
  if (is_elsewhere) track.evidence.forget();
  if (!is_predictable) track.evidence.predictable_until.reset();
  return true;
}

TrackerStatus BlinkTracker::status() const {
  TrackerStatus status = counts_;
  status.tracks = tracks_.size();
  for (const LightTrack& track : tracks_)
    if (IdDecoder::is_identified(track.evidence)) ++status.identified;
  return status;
}

}  // namespace crepes
