#include "estimator/swarm/neighbor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace crepes {
namespace {

constexpr Duration kMaxAge = std::chrono::milliseconds{20};  // of a published state
constexpr Duration kMaxBehind = std::chrono::seconds{1};
constexpr Duration kSilence = std::chrono::seconds{2};
// The tight filter takes the bearings of its raw pose once more, by themselves: what the raw pose
// says of them must not count.
constexpr double kLooseBearing = 0.05;      // rad
constexpr double kLateMemory = 1.0 / 16.0;  // of ranges
constexpr double kHiddenShare = 0.25;       // in line of sight reflections are rarer
constexpr Duration kHiddenAfter = std::chrono::milliseconds{150};
constexpr Duration kCorrectionLife = std::chrono::milliseconds{400};

double calibration_sigma_rad(const FilterSettings& settings) {
  return settings.profile == Profile::kTight ? kLooseBearing : settings.priors.misalignment_rad;
}

double single_range_sigma_m(const FilterSettings& settings) {
  return std::hypot(settings.range_sigma_m, settings.priors.range_bias_m);
}

}  // namespace

Neighbor::Neighbor(const MemberConfig& self, const MemberConfig& neighbor,
                   const FilterSettings& settings)
    : member_(neighbor),
      self_id_(self.id),
      mounting_{self.p_body_led, self.p_body_uwb, neighbor.p_body_led, neighbor.p_body_uwb},
      settings_(settings),
      sightings_(self, neighbor, calibration_sigma_rad(settings), single_range_sigma_m(settings)),
      sequencer_(settings.lag),
      hypotheses_(settings, mounting_),
      look_ahead_(mounting_, settings.gates) {
  status_.neighbor = neighbor.id;
  status_.name = neighbor.name;
}

void Neighbor::reconfigure(const FilterSettings& settings) {
  // What waits is meant for the filter that there was.
  if (settings.profile != settings_.profile) sequencer_.clear();
  settings_ = settings;
  sightings_.set_sigmas(calibration_sigma_rad(settings), single_range_sigma_m(settings));
  sequencer_.set_lag(settings.lag);
  hypotheses_.reconfigure(settings);
  look_ahead_ = LookAhead(mounting_, settings_.gates);
}

void Neighbor::add_bearing(const Bearing& bearing) {
  last_seen_ = std::max(last_seen_, bearing.stamp);
  sightings_.add_own(bearing);
  enqueue({bearing.stamp, MeasurementKind::kBearing,
           DirectionReading{bearing.u_B, bearing.p_B_C, bearing.sigma_rad}});
}

void Neighbor::add_range(const UwbRange& range) { take_range(range, MeasurementKind::kRange); }

void Neighbor::take_range(const UwbRange& range, MeasurementKind kind) {
  const bool plausible = range.range_m > 0.0 && range.range_m <= settings_.max_range_m;
  const bool late_path = range.received_dbm - range.first_path_dbm > settings_.late_path_db;
  late_share_ += kLateMemory * ((late_path ? 1.0 : 0.0) - late_share_);
  // Behind something, the range whose first path looks strong enough is long all the same.
  const Timestamp seen = std::max(last_seen_, last_seen_by_);
  const bool hidden = late_share_ > kHiddenShare && range.stamp - seen > kHiddenAfter;
  if (!plausible || late_path || hidden) {
    note(range.stamp, kind, {.verdict = Verdict::kGated});
    return;
  }
  last_range_ = std::max(last_range_, range.stamp);
  sightings_.add_range(range.stamp, range.range_m);
  enqueue({range.stamp, kind, RangeReading{range.range_m, settings_.range_sigma_m}});
}

void Neighbor::add_report(const ReceivedReport& received, const RobotState& self) {
  const Report& report = received.report;
  last_heard_ = std::max(last_heard_, report.stamp);
  for (const ImuSample& sample : report.imu) {
    if (body_.add(sample)) look_ahead_.look_again_from(sample.stamp);
  }
  if (!body_.tilt || report.tilt.stamp > body_.tilt->stamp) body_.tilt = report.tilt;
  for (const UwbRange& range : report.ranges) {
    if (range.neighbor == self_id_) take_range(range, MeasurementKind::kPeerRange);
  }
  for (const Bearing& bearing : report.bearings) {
    if (bearing.neighbor == self_id_) take_peer_bearing(bearing, received.clock_sigma_s, self);
  }
  for (const NeighborEstimate& estimate : report.estimates) {
    if (estimate.neighbor == self_id_) take_peer_estimate(estimate);
  }
}

// It sees us and we do not see it: what it makes of us, the other way round, is better than
// nothing.
void Neighbor::take_peer_estimate(const NeighborEstimate& estimate) {
  if (settings_.profile == Profile::kPaper || !hypotheses_.empty() || !one_way_lasts_) return;
  enqueue({estimate.stamp, MeasurementKind::kRawPose, OneWayStart{{inverse(estimate.T_B_N)}}});
}

void Neighbor::take_peer_bearing(const Bearing& bearing, double clock_sigma_s,
                                 const RobotState& self) {
  last_seen_by_ = std::max(last_seen_by_, bearing.stamp);
  // A stamp off by dt turns the direction by w dt.
  const double w = body_.imu.empty() ? 0.0 : body_.imu.newest().gyro_radps.norm();
  const double sigma = std::hypot(bearing.sigma_rad, w * clock_sigma_s);
  enqueue({bearing.stamp, MeasurementKind::kPeerBearing,
           DirectionReading{bearing.u_B, bearing.p_B_C, sigma}});

  sightings_.add_peer(bearing);
  const bool wanted =
      settings_.profile == Profile::kPaper || hypotheses_.wants_start(bearing.stamp);
  if (!wanted || self.is_blind(bearing.stamp) || body_.is_blind(bearing.stamp)) return;
  const auto result = sightings_.starts(bearing, self, body_);
  if (const auto* starts = std::get_if<std::vector<MutualStart>>(&result)) {
    raw_reason_ = NoPoseReason::kNone;
    for (const MutualStart& start : *starts)
      enqueue({bearing.stamp, MeasurementKind::kRawPose, start});
  } else {
    raw_reason_ = std::get<NoPoseReason>(result);
    note(bearing.stamp, MeasurementKind::kRawPose, {.verdict = Verdict::kDegenerate});
  }
}

void Neighbor::add_graph_pose(Timestamp stamp, const GraphPose& pose) {
  const bool sighted =
      !hypotheses_.empty() &&
      stamp - hypotheses_.leader().heaviest().last_sighting() <= settings_.recent + settings_.lag;
  if (!sighted) {
    if (!body_.is_blind(stamp)) enqueue({stamp, MeasurementKind::kGraphPose, pose});
    return;
  }
  // The graph rests on this filter's own edge: fusing it back would count that twice. It is laid
  // over what is published instead.
  if (!pose_ || pose_->stamp < stamp) return;
  correction_ =
      Correction{stamp, pose_difference(pose_->T_B_N.pose, pose.T_B_N.pose), pose.T_B_N.covariance};
}

void Neighbor::enqueue(Measurement measurement) {
  const MeasurementKind kind = measurement.kind;
  const Timestamp stamp = measurement.stamp;
  const bool poses_only = settings_.profile == Profile::kPaper;
  if (poses_only && kind != MeasurementKind::kRawPose && kind != MeasurementKind::kGraphPose)
    return;
  if (!sequencer_.push(std::move(measurement))) {
    note(stamp, kind, {.verdict = Verdict::kLate});
  } else {
    look_ahead_.look_again_from(stamp);
  }
}

void Neighbor::note(Timestamp stamp, MeasurementKind kind, const Fusion& fusion) {
  ++status_.measurements[static_cast<std::size_t>(kind)][static_cast<std::size_t>(fusion.verdict)];
  std::optional<Timestamp>& newest = status_.newest[static_cast<std::size_t>(kind)];
  newest = std::max(newest.value_or(stamp), stamp);
  if (keeps_records_) records_.measurements.push_back({member_.id, stamp, kind, fusion});
}

void Neighbor::tick(Timestamp now, const RobotState& self) {
  pose_.reset();
  // Bearings show neither robot's roll about the line between them: without an IMU, a filter holds
  // what it cannot know for known.
  if (now - last_heard_ > settings_.forget || self.is_blind(now) || body_.is_blind(now)) {
    hypotheses_.clear();
  }
  try_one_way(now, self);
  release(now, self);
  find_pose(now, self);
  if (keeps_records_ && !hypotheses_.empty()) {
    if (const auto calibration = hypotheses_.leader().heaviest().calibration()) {
      records_.calibrations.push_back(*calibration);
      records_.calibrations.back().neighbor = member_.id;
    }
  }
  reason_ = pose_ ? NoPoseReason::kNone : reason(now, self);
}

// Where for two seconds just one of the two has seen the other, that has to do.
void Neighbor::try_one_way(Timestamp now, const RobotState& self) {
  constexpr Duration kRecent = std::chrono::milliseconds{500};
  constexpr Duration kLasting = std::chrono::seconds{2};
  const bool we_see = now - last_seen_ < kRecent;
  const bool it_sees = now - last_seen_by_ < kRecent;
  if (one_way_since_ == kNever || we_see == it_sees) one_way_since_ = now;
  one_way_lasts_ = now - one_way_since_ > kLasting;
  if (!one_way_lasts_ || !we_see || !hypotheses_.empty() || settings_.profile == Profile::kPaper)
    return;
  if (auto start = sightings_.one_way_start(self, body_)) enqueue(std::move(*start));
}

void Neighbor::release(Timestamp now, const RobotState& self) {
  const bool can_move = !self.imu.empty() && !body_.imu.empty();
  for (auto group = sequencer_.pop_ready(now); !group.empty(); group = sequencer_.pop_ready(now)) {
    const Measurement& first = group.front();
    const bool is_late = !hypotheses_.empty() && first.stamp < hypotheses_.stamp();
    if (can_move && !is_late && is_a_start(first)) {
      start(group, self);
      continue;
    }
    const bool usable = can_move && !is_late && !hypotheses_.empty();
    const Association association = usable ? hypotheses_.fuse(group, self.imu, body_.imu)
                                           : Association{.fusion{.verdict = Verdict::kNoState}};
    const Fusion other{.verdict = usable ? Verdict::kGated : Verdict::kNoState};
    for (std::size_t i = 0; i < group.size(); ++i)
      note(first.stamp, first.kind, i == association.chosen ? association.fusion : other);
  }
  hypotheses_.settle();
  // Without readings the filter follows all the same: no further behind than IMU samples are kept,
  // and looking ahead costs no more as a silence grows.
  const Timestamp latest_start = now - settings_.lag - kMaxBehind;
  if (can_move && !hypotheses_.empty() && hypotheses_.stamp() < latest_start)
    hypotheses_.advance_to(latest_start, self.imu, body_.imu);
}

bool Neighbor::is_a_start(const Measurement& measurement) const {
  if (measurement.kind == MeasurementKind::kRawPose)
    return settings_.profile == Profile::kTight || hypotheses_.wants_start(measurement.stamp);
  return measurement.kind == MeasurementKind::kGraphPose &&
         (hypotheses_.empty() || !hypotheses_.leader().heaviest().is_certain());
}

void Neighbor::start(std::span<const Measurement> group, const RobotState& self) {
  const Timestamp stamp = group.front().stamp;
  if (!hypotheses_.has_time_for(group.size(), stamp)) {
    for (const Measurement& measurement : group)
      note(stamp, measurement.kind, {.verdict = Verdict::kSkipped});
    return;
  }
  hypotheses_.advance_to(stamp, self.imu, body_.imu);
  for (const Measurement& measurement : group) {
    const bool started = std::visit(
        [&](const auto& first) {
          if constexpr (requires { hypotheses_.start(stamp, first); }) {
            return hypotheses_.start(stamp, first);
          } else {
            return false;
          }
        },
        measurement.reading);
    if (started) note(stamp, measurement.kind, {.verdict = Verdict::kFused});
  }
}

void Neighbor::find_pose(Timestamp now, const RobotState& self) {
  if (!hypotheses_.is_settled() || self.imu.empty() || body_.imu.empty()) return;
  const Timestamp state_time = std::clamp(self.imu.newest().stamp, now - kMaxAge, now);
  if (hypotheses_.stamp() > state_time) return;
  const NeighborTrack head =
      look_ahead_.at(state_time, hypotheses_, {sequencer_.pending(), self.imu, body_.imu});
  const GaussianPose T_B_N = hypotheses_.leader().mean(head.pose());
  if (!is_certain(T_B_N.covariance)) return;
  if (hypotheses_.generation() != std::exchange(generation_, hypotheses_.generation())) {
    ++starts_;
    correction_.reset();
  }

  const auto is_recent = [&](Timestamp t) { return state_time - t <= settings_.recent; };
  const Timestamp graph = head.last(MeasurementKind::kGraphPose);
  const bool sighted = is_recent(head.last_sighting());
  NeighborPose pose;
  pose.neighbor = member_.id;
  pose.stamp = state_time;
  pose.published = now;
  pose.mode = sighted            ? PoseMode::kDirect
              : is_recent(graph) ? PoseMode::kGraph
                                 : PoseMode::kPredicted;
  pose.T_B_N = T_B_N;
  pose.v_B_N = head.motion().v_B_N;
  const Timestamp range =
      std::max(head.last(MeasurementKind::kRange), head.last(MeasurementKind::kPeerRange));
  pose.age_s = to_seconds(state_time - std::max({head.last_sighting(), graph, range}));
  pose.reset_counter = starts_;
  pose.sources = {.bearing = is_recent(last_seen_),
                  .peer_bearing = is_recent(last_seen_by_),
                  .range = is_recent(last_range_),
                  .imu = is_recent(body_.imu.newest().stamp),
                  .graph = is_recent(graph)};
  pose_ = pose;
}

std::optional<NeighborEstimate> Neighbor::estimate() const {
  if (!pose_ || pose_->mode != PoseMode::kDirect) return std::nullopt;
  return NeighborEstimate{pose_->stamp, member_.id, pose_->T_B_N, pose_->v_B_N};
}

std::optional<NeighborPose> Neighbor::improved_pose() const {
  if (!pose_ || !correction_ || pose_->mode != PoseMode::kDirect ||
      pose_->stamp - correction_->stamp > kCorrectionLife) {
    return pose_;
  }
  NeighborPose improved = *pose_;
  improved.T_B_N = {perturbed(pose_->T_B_N.pose, correction_->step), correction_->covariance};
  improved.sources.graph = true;
  return improved;
}

NoPoseReason Neighbor::reason(Timestamp now, const RobotState& self) const {
  if (last_heard_ == kNever) return NoPoseReason::kNeverHeard;
  if (now - last_heard_ > kSilence) return NoPoseReason::kSilent;
  if (self.is_blind(now)) return NoPoseReason::kNoOwnImu;
  if (body_.is_blind(now)) return NoPoseReason::kNoPeerImu;
  if (!self.tilt || !body_.tilt) return NoPoseReason::kTiltUnknown;
  if (now - last_seen_ > kSilence) return NoPoseReason::kNotSeen;
  if (now - last_seen_by_ > kSilence) return NoPoseReason::kDoesNotSeeUs;
  if (now - last_range_ > kSilence) return NoPoseReason::kNoRange;
  if (raw_reason_ != NoPoseReason::kNone) return raw_reason_;
  const bool contested = !hypotheses_.empty() && !hypotheses_.is_settled();
  return contested ? NoPoseReason::kContested : NoPoseReason::kUncertain;
}

NeighborStatus Neighbor::status() const {
  NeighborStatus status = status_;
  status.reason = reason_;
  status.pose = improved_pose();
  if (!body_.imu.empty()) status.newest_imu = body_.imu.newest().stamp;
  return status;
}

}  // namespace crepes
