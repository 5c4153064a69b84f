#include "estimator/swarm/pose_publisher.hpp"

#include <algorithm>
#include <utility>

#include "estimator/relative/propagation.hpp"
#include "estimator/team/team_prediction.hpp"

namespace crepes {
namespace {

constexpr Duration kMaxAge = std::chrono::milliseconds{20};  // of a published state
constexpr Duration kCorrectionLife = std::chrono::milliseconds{400};
constexpr Duration kUnranged = std::chrono::seconds{1};  // so long a distance stays certain
constexpr Duration kRareRanges = std::chrono::milliseconds{200};  // more are refused, not rare
constexpr Duration kDispute = std::chrono::seconds{1};
constexpr Duration kPause = std::chrono::milliseconds{200};     // between comparisons
constexpr Duration kRestart = std::chrono::seconds{2};          // until a filter is there again
constexpr Duration kTeamLife = std::chrono::milliseconds{800};  // the longest lag, and a solution

/// The instant that is published: our newest sample's, unless that is too old.
Timestamp published_instant(Timestamp now, const RobotState& self) {
  return std::clamp(self.imu.newest().stamp, now - kMaxAge, now);
}

/// A pose that is wrong, or one that differs from it by so much is.
std::optional<NeighborPose> doubtful(NeighborPose pose, const Vector6d& difference) {
  pose.T_B_N.covariance += difference * difference.transpose();
  return is_certain(pose.T_B_N.covariance) ? std::optional(pose) : std::nullopt;
}

}  // namespace

PosePublisher::PosePublisher(RobotId neighbor, PairMounting mounting,
                             const FilterSettings& settings)
    : neighbor_(neighbor),
      mounting_(std::move(mounting)),
      settings_(settings),
      predictor_(mounting_, settings.gates) {}

void PosePublisher::reconfigure(const FilterSettings& settings) {
  settings_ = settings;
  predictor_ = OutputPredictor(mounting_, settings.gates);
}

NeighborPose PosePublisher::pose_at(Timestamp stamp, Timestamp now, const RobotState& neighbor,
                                    const LastContact& last) const {
  const auto is_recent = [&](Timestamp t) { return stamp - t <= settings_.recent; };
  NeighborPose pose;
  pose.neighbor = neighbor_;
  pose.stamp = stamp;
  pose.published = now;
  pose.reset_counter = starts_;
  pose.sources = {.bearing = is_recent(last.seen),
                  .peer_bearing = is_recent(last.seen_by),
                  .range = is_recent(last.ranged),
                  .imu = is_recent(neighbor.imu.newest().stamp)};
  return pose;
}

void PosePublisher::update(Timestamp now, const RobotState& self, const RobotState& neighbor,
                           const HypothesisSet& hypotheses, ReadingIntake& intake) {
  const Timestamp stamp = published_instant(now, self);
  if (hypotheses.stamp() > stamp) return;
  const NeighborTrack track =
      predictor_.predict(stamp, hypotheses, {intake.buffer().pending(), self.imu, neighbor.imu});
  const GaussianPose T_B_N = hypotheses.leader().mean(track, self.imu, neighbor.imu);
  if (!is_certain(T_B_N.covariance) || track.is_contradicted()) return;
  if (hypotheses.generation() != std::exchange(generation_, hypotheses.generation())) {
    ++starts_;
    started_ = stamp;
    correction_.reset();
    recent_poses_ = {};
  }
  recent_poses_.add({stamp, T_B_N.pose});
  if (correction_ && stamp - correction_->stamp > kCorrectionLife) correction_.reset();
  if (correction_) {
    const Matrix6d turn = error_rotation(self.imu, neighbor.imu, correction_->axes, stamp);
    correction_->step = turn * correction_->step;
    correction_->covariance = (turn * correction_->covariance * turn.transpose()).eval();
    correction_->axes = stamp;
  }

  const auto is_recent = [&](Timestamp t) { return stamp - t <= settings_.recent; };
  const Timestamp graph = track.last(MeasurementKind::kGraphPose);
  const Timestamp range =
      std::max(track.last(MeasurementKind::kRange), track.last(MeasurementKind::kPeerRange));
  NeighborPose pose = pose_at(stamp, now, neighbor, intake.last_contact());
  pose.mode = is_recent(track.last_sighting()) ? PoseMode::kDirect
              : is_recent(graph)               ? PoseMode::kGraph
                                               : PoseMode::kPredicted;
  pose.T_B_N = T_B_N;
  pose.v_B_N = track.motion().v_B_N;
  pose.age_s = to_seconds(stamp - std::max({track.last_sighting(), graph, range}));
  pose.sources.graph = is_recent(graph);
  pose_ = pose;
  is_half_contradicted_ = track.is_diverged();
  speed_sigma_ = track.speed_sigma();
  is_by_imus_ = stamp - range > kUnranged && stamp - intake.newest_range() > kRareRanges;
}

void PosePublisher::add_graph_correction(Timestamp stamp, const GraphPose& pose) {
  const auto then = std::ranges::find(recent_poses_.all(), stamp, &StampedPose::stamp);
  if (then == recent_poses_.all().end()) return;
  correction_ = Correction{stamp, stamp, pose_difference(then->T_B_N, pose.T_B_N.pose),
                           pose.T_B_N.covariance};
}

std::optional<NeighborEstimate> PosePublisher::estimate() const {
  constexpr Duration kSettling = std::chrono::milliseconds{500};
  const bool is_settled = pose_ && pose_->stamp - started_ >= kSettling &&
                          speed_sigma_ <= NeighborEstimate::kSpeedSigma;
  if (!is_settled || pose_->mode != PoseMode::kDirect) return std::nullopt;
  return NeighborEstimate{pose_->stamp, neighbor_, pose_->T_B_N, pose_->v_B_N};
}

std::optional<NeighborPose> PosePublisher::graph_corrected_pose() const {
  if (!pose_ || !correction_ || pose_->mode != PoseMode::kDirect) return pose_;
  NeighborPose corrected = *pose_;
  corrected.T_B_N = {perturbed(pose_->T_B_N.pose, correction_->step), correction_->covariance};
  corrected.sources.graph = true;
  return is_certain(corrected.T_B_N.covariance) ? corrected : pose_;
}

void PosePublisher::update_team(Timestamp now, const RobotState& self, const RobotState& neighbor,
                                const LastContact& last) {
  if (!team_) return;
  const Timestamp stamp = published_instant(now, self);
  if (stamp < team_->stamp || stamp - team_->stamp > kTeamLife) return;
  const TeamPose team =
      predicted(team_->pose, {self.imu, neighbor.imu, team_->bias_B, team_->bias_N}, team_->stamp,
                stamp, settings_.noise);
  // Where it is the only one, a robot that the team placed anew is a jump.
  if (std::exchange(team_since_, team_->pose.since) != team_->pose.since && !pose_) ++starts_;
  const auto is_recent = [&](Timestamp t) { return stamp - t <= settings_.recent; };
  const bool team_sees = team_->stamp - team.last_sighting <= settings_.recent;
  const Timestamp sighted = std::max(last.seen, last.seen_by);
  NeighborPose pose = pose_at(stamp, now, neighbor, last);
  pose.mode = is_recent(sighted) ? PoseMode::kDirect
              : team_sees        ? PoseMode::kGraph
                                 : PoseMode::kPredicted;
  pose.T_B_N.pose = team.T_B_N;
  pose.T_B_N.covariance = team.pose_covariance();
  pose.v_B_N = team.v_B_N;
  pose.age_s = std::max(0.0, to_seconds(stamp - std::max(sighted, team.last_sighting)));
  pose.sources.graph = true;
  if (!is_certain(pose.T_B_N.covariance)) return;
  team_pose_ = pose;
  if (dispute_) {
    dispute_->difference =
        error_rotation(self.imu, neighbor.imu, dispute_->axes, stamp) * dispute_->difference;
    dispute_->axes = stamp;
  }
  compare();
}

/// What a filter out of sight predicts disputes nothing.
void PosePublisher::compare() {
  if (!pose_ || pose_->mode == PoseMode::kPredicted) return;
  if (team_->pose.was_knocked) return dispute_.reset();
  const Vector6d d = pose_difference(pose_->T_B_N.pose, team_pose_->T_B_N.pose);
  const Matrix6d covariance = pose_->T_B_N.covariance + team_pose_->T_B_N.covariance;
  if (d.dot(covariance.llt().solve(d)) <= settings_.gates.pose) return dispute_.reset();
  const Timestamp now = team_pose_->stamp;
  if (!dispute_ || now - dispute_->last > kRestart) dispute_ = Dispute{.since = now};
  if (now - dispute_->last > kPause) dispute_->since = now;
  dispute_->last = dispute_->axes = now;
  dispute_->difference = d;
}

bool PosePublisher::is_disputed() const {
  return team_pose_ && dispute_ && dispute_->last == team_pose_->stamp;
}

bool PosePublisher::take_restart() {
  if (!is_disputed() || dispute_->last - dispute_->since < kDispute ||
      team_->pose.needs_confirmation || is_by_imus_)
    return false;
  dispute_->since = dispute_->restarted = dispute_->last;
  return true;
}

std::optional<NeighborPose> PosePublisher::published() const {
  if (!team_pose_) return is_half_contradicted_ ? std::nullopt : graph_corrected_pose();
  const bool needs_confirmation = team_->pose.needs_confirmation;
  if (!pose_ || pose_->mode == PoseMode::kPredicted) {
    if (needs_confirmation) return graph_corrected_pose();
    const bool restarts = dispute_ && team_pose_->stamp - dispute_->restarted <= kRestart;
    return restarts ? doubtful(*team_pose_, dispute_->difference) : team_pose_;
  }
  if (!is_disputed()) return team_pose_;
  if (needs_confirmation) return graph_corrected_pose();
  // One of the two is wrong, and what shows which is how the pair knows its distance.
  return is_by_imus_ ? team_pose_ : doubtful(*pose_, dispute_->difference);
}

}  // namespace crepes
