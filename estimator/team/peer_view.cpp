#include "estimator/team/peer_view.hpp"

#include <algorithm>
#include <limits>
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

/// Infinite without any pose [m^2].
double mean_variance(const TeamSolution& solution) {
  if (solution.poses.empty()) return std::numeric_limits<double>::infinity();
  double sum = 0.0;
  for (const TeamPose& pose : solution.poses) sum += pose.covariance.topLeftCorner<3, 3>().trace();
  return sum / static_cast<double>(solution.poses.size());
}

}  // namespace

std::optional<TeamSolution> PeerView::step(const TeamInterval& interval) {
  const bool is_lit = std::ranges::any_of(interval.bearings, [&](const TeamBearing& reading) {
    return concerns(reading, interval.self);
  });
  if (is_lit) lit_ = interval.to;
  if (interval.to - lit_ < kDark || interval.members.size() < kLeastMembers) {
    forget();
    return std::nullopt;
  }
  choose_peer(interval);
  if (peer_ == RobotId{}) return std::nullopt;
  TeamSolution solution = filter_.step(as_of(peer_, interval));
  if (std::ranges::find(solution.faults, peer_, &TeamFault::robot) != solution.faults.end()) {
    former_ = peer_;
    peer_ = {};
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
  solution.calibrations = calibrations_of(seen, interval.settings.priors);
  return solution;
}

void PeerView::forget() {
  peer_ = {};
  former_ = {};
}

/// The one with most bearings, as long as it has any.
void PeerView::choose_peer(const TeamInterval& interval) {
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
  peer_ = std::ranges::max_element(bearings, {}, &std::pair<const RobotId, int>::second)->first;
  peer_lit_ = interval.to;
  filter_ = {};
}

const TeamSolution& better_of(const TeamSolution& a, const TeamSolution& b) {
  return mean_variance(b) < mean_variance(a) ? b : a;
}

}  // namespace crepes
