#include "estimator/swarm/swapped_modules.hpp"

#include <algorithm>

namespace crepes {
namespace {

constexpr int kLeastRanges = 3;  // one may be a damaged frame
constexpr Duration kMemory = std::chrono::seconds{10};

}  // namespace

void SwappedModules::add(RobotId observer, const UwbRange& range) {
  if (range.neighbor != observer) return;
  Evidence& evidence = evidence_[observer];
  if (range.stamp - evidence.last > kMemory) evidence = {};
  ++evidence.ranges;
  evidence.last = std::max(evidence.last, range.stamp);
  evidence.range_m = range.range_m;
}

bool SwappedModules::contains(RobotId robot, Timestamp now) const {
  const auto found = evidence_.find(robot);
  return found != evidence_.end() && found->second.ranges >= kLeastRanges &&
         now - found->second.last <= kMemory;
}

std::optional<TeamFault> SwappedModules::fault_of(RobotId robot, Timestamp now) const {
  if (!contains(robot, now)) return std::nullopt;
  return TeamFault{robot, TeamFault::Kind::kModule, evidence_.at(robot).range_m};
}

}  // namespace crepes
