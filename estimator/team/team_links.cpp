#include "estimator/team/team_links.hpp"

#include <cmath>
#include <iterator>
#include <utility>

#include "estimator/team/belief/place_chains.hpp"

namespace crepes {
namespace {

constexpr double kLinkMemory = 2.0;  // s
constexpr Duration kBetweenExchanges = std::chrono::seconds{2};
// So many times as many links, and one more: what changes from moment to moment is less.
constexpr double kClearly = 1.5;

/// The filter's robots, and those that could join because an estimate connects them.
std::set<RobotId> connected(const TeamInterval& interval, const TeamBelief& belief,
                            const std::set<RobotId>& liars) {
  std::set<RobotId> robots;
  for (const auto& [id, robot] : belief.robots) robots.insert(id);
  for (const RelativePoseEdge& edge : interval.edges) {
    if (!can_place(edge, liars)) continue;
    if (belief.robots.contains(edge.from)) robots.insert(edge.to);
    if (belief.robots.contains(edge.to)) robots.insert(edge.from);
  }
  return robots;
}

}  // namespace

void TeamLinks::add(const TeamInterval& interval, const TeamBelief& belief,
                    const std::set<RobotId>& liars) {
  std::map<RobotId, std::set<RobotId>> linked;
  for (const TeamMember& member : interval.members) linked[member.robot];
  const std::set<RobotId> known = connected(interval, belief, liars);
  for (const TeamBearing& reading : interval.bearings) {
    for (const auto& [a, b] : {std::pair(reading.observer, reading.bearing.neighbor),
                               std::pair(reading.bearing.neighbor, reading.observer)}) {
      if (linked.contains(a) && known.contains(a) && belief.robots.contains(b)) linked[a].insert(b);
    }
  }
  std::erase_if(links_, [&](const auto& entry) { return !linked.contains(entry.first); });
  const double weight = 1.0 - std::exp(-to_seconds(interval.to - interval.from) / kLinkMemory);
  for (const auto& [robot, others] : linked) {
    double& mean = links_[robot];
    mean += weight * (static_cast<double>(others.size()) - mean);
  }
}

std::optional<TeamLinks::Exchange> TeamLinks::exchange(Timestamp now, const TeamBelief& belief) {
  if (last_ && now - *last_ < kBetweenExchanges) return std::nullopt;
  auto worst = links_.end();
  auto best = links_.end();
  for (auto robot = links_.begin(); robot != links_.end(); ++robot) {
    if (robot->first == belief.self) continue;
    if (!belief.robots.contains(robot->first)) {
      if (best == links_.end() || robot->second > best->second) best = robot;
    } else if (worst == links_.end() || robot->second < worst->second) {
      worst = robot;
    }
  }
  if (worst == links_.end() || best == links_.end() ||
      best->second < kClearly * worst->second + 1.0)
    return std::nullopt;
  last_ = now;
  return Exchange{.leaves = worst->first, .joins = best->first};
}

}  // namespace crepes
