#include "daemon/ctl/view/pose_history.hpp"

#include <algorithm>
#include <chrono>

namespace crepes {
namespace {

constexpr Duration kMemory = std::chrono::seconds{1};
constexpr Duration kNear = std::chrono::milliseconds{100};

}  // namespace

void PoseHistory::add(const NeighborPose& pose) {
  auto& entries = entries_[pose.neighbor];
  if (!entries.empty() && pose.stamp <= entries.back().stamp) entries.clear();
  entries.push_back({pose.stamp, pose.T_B_N.pose});
  while (entries.back().stamp - entries.front().stamp > kMemory) entries.pop_front();
}

std::optional<Pose> PoseHistory::at(RobotId neighbor, Timestamp t) const {
  const auto found = entries_.find(neighbor);
  if (found == entries_.end()) return std::nullopt;
  const auto& entries = found->second;
  const auto after = std::ranges::lower_bound(entries, t, {}, &Entry::stamp);
  const bool has_after = after != entries.end() && after->stamp - t <= kNear;
  const auto before = after == entries.begin() ? entries.end() : std::prev(after);
  const bool has_before = before != entries.end() && t - before->stamp <= kNear;
  if (!has_after && !has_before) return std::nullopt;
  if (!has_before) return after->T_B_N;
  if (!has_after) return before->T_B_N;
  const double s = to_seconds(t - before->stamp) / to_seconds(after->stamp - before->stamp);
  const Pose& a = before->T_B_N;
  const Pose& b = after->T_B_N;
  return Pose{.p = a.p + s * (b.p - a.p), .q = a.q.slerp(s, b.q)};
}

}  // namespace crepes
