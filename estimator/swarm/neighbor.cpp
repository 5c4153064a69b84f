#include "estimator/swarm/neighbor.hpp"

#include <cmath>

namespace crepes {
namespace {

constexpr Duration kMaxBehind = std::chrono::seconds{1};
constexpr Duration kSilence = std::chrono::seconds{2};

PairMounting mounting_of(const MemberConfig& self, const MemberConfig& neighbor) {
  return {self.p_body_led, self.p_body_uwb, neighbor.p_body_led, neighbor.p_body_uwb};
}

}  // namespace

Neighbor::Neighbor(const MemberConfig& self, const MemberConfig& neighbor,
                   const FilterSettings& settings)
    : id_(neighbor.id),
      self_id_(self.id),
      mounting_(mounting_of(self, neighbor)),
      recent_(settings.recent),
      intake_(neighbor.id, settings),
      initiator_(self, neighbor, settings),
      hypotheses_(settings, mounting_),
      publisher_(neighbor.id, mounting_, settings) {}

void Neighbor::reconfigure(const FilterSettings& settings) {
  recent_ = settings.recent;
  intake_.reconfigure(settings);
  initiator_.reconfigure(settings);
  hypotheses_.reconfigure(settings);
  publisher_.reconfigure(settings);
}

void Neighbor::add(const Bearing& bearing) {
  initiator_.add_bearing(bearing);
  intake_.add_bearing(bearing);
}

void Neighbor::add(const UwbRange& range) {
  if (intake_.add_range(range, MeasurementKind::kRange))
    initiator_.add_range(range.stamp, range.range_m);
}

void Neighbor::refuse(const UwbRange& range, MeasurementKind kind) {
  outcomes().add(range.stamp, kind, {.verdict = Verdict::kGated}, {range.range_m});
}

void Neighbor::add_report(const ReceivedReport& received, const RobotState& self) {
  const Report& report = received.report;
  intake_.add_report_stamp(report.stamp);
  for (const ImuSample& sample : report.imu) {
    for (const ImuSample& believed : body_.guard.accept(sample)) {
      if (!body_.add_believed(believed)) continue;
      const auto rates = body_.guard.rates_before(believed);
      publisher_.invalidate_from(rates.empty() ? believed.stamp : rates.front().sample.stamp);
    }
  }
  if (!body_.tilt || report.tilt.stamp > body_.tilt->stamp) body_.tilt = report.tilt;
  for (const UwbRange& range : report.ranges) {
    if (range.neighbor == self_id_ && intake_.add_range(range, MeasurementKind::kPeerRange))
      initiator_.add_range(range.stamp, range.range_m);
  }
  for (const Bearing& bearing : report.bearings) {
    if (bearing.neighbor != self_id_) continue;
    // An error dt of the stamp turns the direction by w dt.
    const double w = body_.imu.empty() ? 0.0 : body_.imu.newest().gyro_radps.norm();
    intake_.add_peer_bearing(bearing, std::hypot(bearing.sigma_rad, w * received.clock_sigma_s));
    initiator_.add_peer_bearing(bearing, self, body_, hypotheses_, intake_);
  }
  for (const NeighborEstimate& estimate : report.estimates) {
    if (estimate.neighbor == self_id_) initiator_.add_peer_estimate(estimate, hypotheses_, intake_);
  }
}

void Neighbor::add(const StampedGraphPose& solution) {
  const auto& [stamp, pose] = solution;
  const bool sighted =
      !hypotheses_.empty() &&
      stamp - hypotheses_.leader().heaviest().last_sighting() <= recent_ + intake_.buffer().lag();
  if (sighted) {
    publisher_.add_graph_correction(stamp, pose);
  } else if (!body_.lacks_imu(stamp)) {
    intake_.enqueue({stamp, MeasurementKind::kGraphPose, pose});
  }
}

void Neighbor::add(const TeamEstimate& estimate) { publisher_.add_team_pose(estimate); }

void Neighbor::tick(Timestamp now, const RobotState& self) {
  publisher_.clear();
  // Bearings do not show either robot's roll about the line of sight. Without both IMUs, the
  // covariance of a filter would be too small.
  const bool have_imus = !self.lacks_imu(now) && !body_.lacks_imu(now);
  if (!have_imus) hypotheses_.clear();
  initiator_.tick(now, self, body_, hypotheses_, intake_);
  fuse_released(now, self);
  if (const auto stamp = intake_.take_earliest_new()) publisher_.invalidate_from(*stamp);
  // What still waited for the lag may have started a filter just now.
  if (have_imus && hypotheses_.is_unambiguous())
    publisher_.update(now, self, body_, hypotheses_, intake_);
  if (have_imus) publisher_.update_team(now, self, body_, intake_.last_contact());
  if (publisher_.take_restart()) hypotheses_.clear();
  if (outcomes().keeps_records() && !hypotheses_.empty())
    outcomes().add(hypotheses_.leader().heaviest().calibration());
  reason_ = publisher_.published() ? NoPoseReason::kNone : reason(now, self);
}

void Neighbor::fuse_released(Timestamp now, const RobotState& self) {
  ReorderBuffer& buffer = intake_.buffer();
  const bool can_move = !self.imu.empty() && !body_.imu.empty();
  for (auto group = buffer.pop_ready(now); !group.empty(); group = buffer.pop_ready(now)) {
    const Measurement& first = group.front();
    const bool is_late = !hypotheses_.empty() && first.stamp < hypotheses_.stamp();
    if (can_move && !is_late && initiator_.is_initialization(first, hypotheses_)) {
      TrackInitiator::initialize(group, self.imu, body_.imu, hypotheses_, outcomes());
      continue;
    }
    const bool usable = can_move && !is_late;
    const Association association = usable ? hypotheses_.fuse(group, self.imu, body_.imu)
                                           : Association{.fusion{.verdict = Verdict::kNoState}};
    const bool is_compared = usable && !hypotheses_.empty();
    const Fusion other{.verdict = is_compared ? Verdict::kGated : Verdict::kNoState};
    for (std::size_t i = 0; i < group.size(); ++i) {
      outcomes().add(first.stamp, first.kind, i == association.chosen ? association.fusion : other,
                     reading_of(group[i]));
    }
  }
  if (can_move && !hypotheses_.empty()) {
    const auto ours = self.tilt_at(hypotheses_.stamp());
    const auto neighbors = body_.tilt_at(hypotheses_.stamp());
    if (ours && neighbors) hypotheses_.compare_tilts(*ours, *neighbors);
  }
  hypotheses_.prune();
  // Without readings the filter advances too: IMU samples are kept for a limited time, and the cost
  // of a prediction must not grow with the silence.
  const Timestamp latest_start = now - buffer.lag() - kMaxBehind;
  if (can_move && !hypotheses_.empty() && hypotheses_.stamp() < latest_start)
    hypotheses_.advance_to(latest_start, self.imu, body_.imu);
}

NoPoseReason Neighbor::reason(Timestamp now, const RobotState& self) const {
  const LastContact& last = intake_.last_contact();
  if (last.heard == kNever) return NoPoseReason::kNeverHeard;
  if (now - last.heard > kSilence) return NoPoseReason::kSilent;
  if (self.lacks_imu(now)) return NoPoseReason::kNoOwnImu;
  if (body_.lacks_imu(now)) return NoPoseReason::kNoPeerImu;
  if (!self.tilt || !body_.tilt) return NoPoseReason::kTiltUnknown;
  if (now - last.seen > kSilence) return NoPoseReason::kNotSeen;
  if (now - last.seen_by > kSilence) return NoPoseReason::kDoesNotSeeUs;
  if (now - last.ranged > kSilence) return NoPoseReason::kNoRange;
  if (initiator_.raw_pose_reason() != NoPoseReason::kNone) return initiator_.raw_pose_reason();
  const bool contested = !hypotheses_.empty() && !hypotheses_.is_unambiguous();
  return contested ? NoPoseReason::kContested : NoPoseReason::kUncertain;
}

NeighborStatus Neighbor::status() const {
  NeighborStatus status;
  status.neighbor = id_;
  status.reason = reason_;
  status.pose = publisher_.published();
  intake_.outcomes().write_to(status);
  status.mounting = mounting_;
  if (!hypotheses_.empty()) status.calibration = hypotheses_.leader().heaviest().calibration();
  status.refused_imu = body_.guard.refused();
  if (!body_.imu.empty()) status.newest_imu = body_.imu.newest().stamp;
  return status;
}

}  // namespace crepes
