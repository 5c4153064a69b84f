#include "estimator/team/trust/team_memory.hpp"

namespace crepes {
namespace {

constexpr Duration kPeriod = std::chrono::seconds{1};
constexpr Duration kLeastAge = std::chrono::seconds{2};  // faults are found sooner
constexpr std::size_t kMaxBeliefs = 4;

}  // namespace

void TeamMemory::add(const TeamBelief& belief) {
  if (!beliefs_.empty() && belief.stamp - beliefs_.back().stamp < kPeriod) return;
  if (belief.robots.size() < 2) return;
  beliefs_.push_back(belief);
  if (beliefs_.size() > kMaxBeliefs) beliefs_.pop_front();
}

void TeamMemory::add_vibration(const TeamInterval& interval) {
  for (TeamBelief& belief : beliefs_) belief.add_vibration(interval);
}

void TeamMemory::remove(RobotId id) {
  for (TeamBelief& belief : beliefs_)
    if (belief.robots.contains(id)) belief.remove(id);
}

std::optional<TeamBelief> TeamMemory::recall(Timestamp now) {
  while (!beliefs_.empty() && now - beliefs_.back().stamp < kLeastAge) beliefs_.pop_back();
  if (beliefs_.empty()) return std::nullopt;
  return beliefs_.back();
}

}  // namespace crepes
