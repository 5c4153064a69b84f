#include "estimator/team/peer_view.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "estimator/team/belief/place_chains.hpp"
#include "estimator/team/belief/root_change.hpp"
#include "estimator/team/keyframe_pose.hpp"
#include "estimator/team/trust/team_faults.hpp"
#include "estimator/team/trust/team_trust.hpp"

namespace crepes {
namespace {

constexpr std::size_t kLeastMembers = 5;  // four beacons, and this robot in the dark

/// The same, as the peer itself would filter it. Of its estimates it has no more than this robot.
TeamInterval as_of(RobotId peer, TeamInterval interval) {
  interval.self = peer;
  for (RelativePoseEdge& edge : interval.edges)
    if (edge.from == peer) edge.T_from_to.covariance += start_floor();
  return interval;
}

}  // namespace

std::optional<PeerView::View> PeerView::step(const TeamInterval& interval, const TeamBelief& own) {
  for (const TeamBearing& reading : interval.bearings) {
    if (reading.observer == interval.self) last_saw_ = interval.to;
    if (reading.bearing.neighbor == interval.self) last_seen_ = interval.to;
  }
  if (own.robots.size() > 1) last_knew_ = interval.to;
  const bool is_dark = interval.to - last_seen_ >= TeamRobot::kUnseenAfter;
  const bool is_blind = interval.to - last_saw_ >= TeamRobot::kUnseenAfter;
  const bool is_alone = !is_dark && interval.to - last_knew_ >= TeamRobot::kUnseenAfter;
  if (!(is_blind || is_alone) || (is_dark && interval.members.size() < kLeastMembers)) {
    forget();
    return std::nullopt;
  }
  choose_peer(interval, own);
  if (peer_ == RobotId{}) return std::nullopt;
  View view{.solution = filter_.step(as_of(peer_, interval)), .belief = {}};
  TeamSolution& solution = view.solution;
  if (std::ranges::find(solution.faults, peer_, &TeamFault::robot) != solution.faults.end()) {
    const RobotId faulty = peer_;
    forget();
    former_ = faulty;
    return std::nullopt;
  }
  const TeamBelief& belief = filter_.belief();
  const auto self = belief.robots.find(interval.self);
  if (self == belief.robots.end()) return std::nullopt;
  const bool needs_confirmation =
      !self->second.is_trusted && !has_plausible_place(belief, interval.self);
  TeamBelief seen = seen_from(interval.self, belief);
  const TeamArcs arcs(seen);
  solution.poses.clear();
  for (const auto& [id, robot] : seen.robots) {
    if (id == interval.self || !robot.is_trusted) continue;
    TeamPose& pose =
        solution.poses.emplace_back(keyframe_pose(seen, arcs, id, *interval.member(id)));
    pose.last_sighting = std::max(self->second.last_sighting, self->second.last_fix);
    pose.needs_confirmation = needs_confirmation;
    pose.was_knocked = filter_.is_knocked(id) || filter_.is_knocked(interval.self);
  }
  if (solution.poses.empty()) return std::nullopt;
  solution.calibrations = calibrations_of(seen, interval.settings.priors);
  if (!is_dark && self->second.is_trusted) view.belief = std::move(seen);
  return view;
}

void PeerView::forget() {
  peer_ = {};
  former_ = {};
  filter_ = {};
}

/// The one whose cameras have most bearings, as long as they have any. One that estimates connect
/// with others comes first: without them, its filter knows nobody.
void PeerView::choose_peer(const TeamInterval& interval, const TeamBelief& own) {
  std::set<RobotId> estimated;
  for (const RelativePoseEdge& edge : interval.edges) {
    if (edge.from != interval.self && edge.to != interval.self)
      estimated.insert({edge.from, edge.to});
  }
  std::map<RobotId, std::pair<bool, int>> merits;  // whether it is estimated, and its bearings
  for (const TeamBearing& reading : interval.bearings) {
    auto& [is_estimated, bearings] = merits[reading.observer];
    is_estimated = estimated.contains(reading.observer);
    ++bearings;
  }
  std::erase_if(merits, [&](const auto& entry) {
    return interval.member(entry.first) == nullptr || entry.first == former_ ||
           entry.first == interval.self;
  });
  const auto best = std::ranges::max_element(merits, {}, [](const auto& e) { return e.second; });
  const auto present = merits.find(peer_);
  if (present != merits.end()) peer_last_saw_ = interval.to;
  const bool is_useless = filter_.belief().robots.size() < 2 && present != merits.end() &&
                          !present->second.first && best->second.first;
  const bool stays = peer_ != RobotId{} && interval.member(peer_) != nullptr &&
                     interval.to - peer_last_saw_ < TeamRobot::kUnseenAfter && !is_useless;
  if (stays || merits.empty()) return;
  const RobotId next = best->first;
  peer_last_saw_ = interval.to;
  if (next == peer_) return;
  peer_ = next;
  const bool goes_on = filter_.belief().robots.contains(interval.self);
  const TeamBelief& known = goes_on ? filter_.belief() : own;
  const auto peer = known.robots.find(peer_);
  const bool is_known =
      known.stamp == interval.from && peer != known.robots.end() && peer->second.is_trusted;
  filter_ = is_known ? TeamFilter(seen_from(peer_, known)) : TeamFilter();
}

}  // namespace crepes
