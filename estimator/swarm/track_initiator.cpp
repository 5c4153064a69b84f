#include "estimator/swarm/track_initiator.hpp"

#include <utility>
#include <variant>

#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

constexpr double kKnown = radians(5.0);  // one sigma, all axes together

bool lacks_reading(const MutualInitializations& result) {
  const auto* const reason = std::get_if<NoPoseReason>(&result);
  return reason != nullptr &&
         (*reason == NoPoseReason::kNotSeen || *reason == NoPoseReason::kNoRange);
}

}  // namespace

TrackInitiator::TrackInitiator(const MemberConfig& self, const MemberConfig& neighbor,
                               const FilterSettings& settings)
    : traits_(settings.traits),
      observations_(self, neighbor, settings.raw_pose_calibration_sigma_rad,
                    settings.raw_pose_range_sigma_m) {}

void TrackInitiator::reconfigure(const FilterSettings& settings) {
  traits_ = settings.traits;
  observations_.set_sigmas(settings.raw_pose_calibration_sigma_rad,
                           settings.raw_pose_range_sigma_m);
}

bool TrackInitiator::needs_raw_pose(const Bearing& bearing, const RobotState& self,
                                    const RobotState& neighbor,
                                    const HypothesisSet& hypotheses) const {
  const bool wanted = !traits_.fuses_single_readings || hypotheses.accepts_raw_pose(bearing.stamp);
  return wanted && !self.lacks_imu(bearing.stamp) && !neighbor.lacks_imu(bearing.stamp);
}

void TrackInitiator::enqueue_raw_poses(Timestamp stamp, const MutualInitializations& result,
                                       ReadingIntake& intake) {
  if (const auto* found = std::get_if<std::vector<MutualInitialization>>(&result)) {
    raw_pose_reason_ = NoPoseReason::kNone;
    for (const MutualInitialization& first : *found)
      intake.enqueue({stamp, MeasurementKind::kRawPose, first});
  } else {
    raw_pose_reason_ = std::get<NoPoseReason>(result);
    intake.outcomes().add(stamp, MeasurementKind::kRawPose, {.verdict = Verdict::kDegenerate});
  }
}

void TrackInitiator::add_peer_bearing(const Bearing& bearing, const RobotState& self,
                                      const RobotState& neighbor, const HypothesisSet& hypotheses,
                                      ReadingIntake& intake) {
  observations_.add_peer_bearing(bearing);
  if (!needs_raw_pose(bearing, self, neighbor, hypotheses)) return;
  const auto result = observations_.mutual_initializations(bearing, self, neighbor);
  if (lacks_reading(result)) {
    waiting_.add(bearing);
  } else {
    enqueue_raw_poses(bearing.stamp, result, intake);
  }
}

// Once: whatever is older than the lag has arrived, or comes too late for the reorder buffer.
void TrackInitiator::join_waiting(Timestamp due, const RobotState& self, const RobotState& neighbor,
                                  const HypothesisSet& hypotheses, ReadingIntake& intake) {
  const auto is_due = [due](const Bearing& bearing) { return bearing.stamp <= due; };
  for (const Bearing& bearing : waiting_.all()) {
    if (!is_due(bearing) || !needs_raw_pose(bearing, self, neighbor, hypotheses)) continue;
    enqueue_raw_poses(bearing.stamp, observations_.mutual_initializations(bearing, self, neighbor),
                      intake);
  }
  waiting_.erase_if(is_due);
}

void TrackInitiator::add_peer_estimate(const NeighborEstimate& estimate,
                                       const HypothesisSet& hypotheses,
                                       ReadingIntake& intake) const {
  const bool is_wanted = hypotheses.empty() || hypotheses.has_open_heading();
  if (!is_wanted || one_way_ != FilterAxes::kNeighbors) return;
  // One that hardly knows how we are turned may be wrong by more than it says.
  if (estimate.T_B_N.covariance.bottomRightCorner<3, 3>().trace() > kKnown * kKnown) return;
  intake.enqueue({estimate.stamp, MeasurementKind::kRawPose,
                  OneWayInitialization{{estimate.T_B_N}, FilterAxes::kNeighbors}});
}

void TrackInitiator::tick(Timestamp now, const RobotState& self, const RobotState& neighbor,
                          const HypothesisSet& hypotheses, ReadingIntake& intake) {
  join_waiting(now - intake.buffer().lag(), self, neighbor, hypotheses, intake);
  constexpr Duration kSeenRecently = std::chrono::milliseconds{500};
  constexpr Duration kLasting = std::chrono::seconds{2};
  const bool we_see = now - intake.last_contact().seen < kSeenRecently;
  const bool it_sees = now - intake.last_contact().seen_by < kSeenRecently;
  if (one_way_since_ == kNever || we_see == it_sees) one_way_since_ = now;
  one_way_.reset();
  if (traits_.starts_one_way && now - one_way_since_ > kLasting)
    one_way_ = we_see ? FilterAxes::kOurs : FilterAxes::kNeighbors;
  if (!one_way_ || !hypotheses.empty()) return;
  if (auto first = observations_.one_way_initialization(*one_way_, self, neighbor))
    intake.enqueue(std::move(*first));
}

bool TrackInitiator::is_initialization(const Measurement& measurement,
                                       const HypothesisSet& hypotheses) const {
  if (measurement.kind == MeasurementKind::kRawPose)
    return traits_.fuses_single_readings || hypotheses.accepts_raw_pose(measurement.stamp);
  return measurement.kind == MeasurementKind::kGraphPose &&
         (hypotheses.empty() || !hypotheses.leader().heaviest().is_certain());
}

void TrackInitiator::initialize(std::span<const Measurement> group, const ImuHistory& imu_B,
                                const ImuHistory& imu_N, HypothesisSet& hypotheses,
                                OutcomeLog& outcomes) {
  const Timestamp stamp = group.front().stamp;
  if (!hypotheses.has_budget_for(group.size(), stamp)) {
    for (const Measurement& measurement : group) {
      outcomes.add(stamp, measurement.kind, {.verdict = Verdict::kSkipped},
                   reading_of(measurement));
    }
    return;
  }
  hypotheses.advance_to(stamp, imu_B, imu_N);
  for (const Measurement& measurement : group) {
    const bool started = std::visit(
        [&](const auto& first) {
          if constexpr (requires { hypotheses.initialize(stamp, first); }) {
            return hypotheses.initialize(stamp, first);
          } else {
            return false;
          }
        },
        measurement.reading);
    if (started) outcomes.add(stamp, measurement.kind, {.verdict = Verdict::kFused});
  }
}

}  // namespace crepes
