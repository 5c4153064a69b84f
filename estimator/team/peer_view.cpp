#include "estimator/team/peer_view.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include "estimator/team/belief/place_chains.hpp"
#include "estimator/team/belief/root_change.hpp"
#include "estimator/team/keyframe_pose.hpp"
#include "estimator/team/trust/team_faults.hpp"
#include "estimator/team/trust/team_trust.hpp"

namespace crepes {
namespace {

constexpr Duration kDark = std::chrono::seconds{1};
constexpr std::size_t kLeastMembers = 5;  // four beacons, and this robot

bool concerns(const TeamBearing& reading, RobotId id) {
  return reading.observer == id || reading.bearing.neighbor == id;
}

/// The same, as the peer itself would filter it. Of its estimates it has no more than this robot.
TeamInterval as_of(RobotId peer, TeamInterval interval) {
  interval.self = peer;
  for (RelativePoseEdge& edge : interval.edges)
    if (edge.from == peer) edge.T_from_to.covariance += start_floor();
  return interval;
}

}  // namespace

std::optional<TeamSolution> PeerView::step(const TeamInterval& interval, const TeamBelief& own) {
  const bool is_lit = std::ranges::any_of(interval.bearings, [&](const TeamBearing& reading) {
    return concerns(reading, interval.self);
  });
  if (is_lit) lit_ = interval.to;
  if (interval.to - lit_ < kDark || interval.members.size() < kLeastMembers) {
    forget();
    return std::nullopt;
  }
  choose_peer(interval, own);
  if (peer_ == RobotId{}) return std::nullopt;
  TeamSolution solution = filter_.step(as_of(peer_, interval));
  if (std::ranges::find(solution.faults, peer_, &TeamFault::robot) != solution.faults.end()) {
    const RobotId faulty = peer_;
    forget();
    former_ = faulty;
    return std::nullopt;
  }
  const TeamBelief& belief = filter_.belief();
  const auto self = belief.robots.find(interval.self);
  if (self == belief.robots.end()) return std::nullopt;
  const bool needs_witness = !self->second.is_trusted && !is_plausible(belief, interval.self);
  const TeamBelief seen = seen_from(interval.self, belief);
  solution.poses.clear();
  for (const auto& [id, robot] : seen.robots) {
    if (id == interval.self || !robot.is_trusted) continue;
    TeamPose& pose = solution.poses.emplace_back(keyframe_pose(seen, id, *interval.member(id)));
    pose.last_sighting = std::max(self->second.last_sighting, self->second.last_fix);
    pose.needs_witness = needs_witness;
  }
  if (solution.poses.empty()) return std::nullopt;
  solution.calibrations = calibrations_of(seen, interval.settings.priors);
  return solution;
}

void PeerView::forget() {
  peer_ = {};
  former_ = {};
  filter_ = {};
}

/// The one with most bearings, as long as it has any.
void PeerView::choose_peer(const TeamInterval& interval, const TeamBelief& own) {
  std::map<RobotId, int> bearings;
  for (const TeamBearing& reading : interval.bearings) {
    ++bearings[reading.observer];
    ++bearings[reading.bearing.neighbor];
  }
  std::erase_if(bearings, [&](const auto& entry) {
    return interval.member(entry.first) == nullptr || entry.first == former_;
  });
  if (bearings.contains(peer_)) peer_lit_ = interval.to;
  const bool stays =
      peer_ != RobotId{} && interval.member(peer_) != nullptr && interval.to - peer_lit_ < kDark;
  if (stays || bearings.empty()) return;
  const RobotId next =
      std::ranges::max_element(bearings, {}, &std::pair<const RobotId, int>::second)->first;
  peer_lit_ = interval.to;
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
