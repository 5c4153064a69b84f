#include "daemon/ctl/demo/demo_pairs.hpp"

#include <fmt/core.h>

#include <string>
#include <variant>

#include "daemon/ctl/live/daemon_access.hpp"
#include "daemon/ctl/score/pair_score.hpp"
#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

/// Rarely, because it moves all that stays.
void forget_old(std::vector<NeighborPose>& poses, Duration kept) {
  const Timestamp newest = poses.back().stamp;
  if (newest - poses.front().stamp < 2 * kept) return;
  std::erase_if(poses, [&](const NeighborPose& pose) { return newest - pose.stamp > kept; });
}

}  // namespace

void DemoPairs::add_observer(RobotId observer, RobotClock clock) {
  clocks_.emplace(observer, clock);
  for (const RobotId neighbor : world_.robots()) {
    if (neighbor == observer) continue;
    index_[{observer, neighbor}] = pairs_.size();
    pairs_.push_back(
        {.observer = observer, .neighbor = neighbor, .view = {}, .poses = {}, .first_pose = {}});
  }
}

void DemoPairs::handle(RobotId observer, const client::Message& message, Timestamp now) {
  const auto pair_with = [&](int neighbor) -> Pair* {
    const auto found = index_.find({observer, RobotId{static_cast<std::uint16_t>(neighbor)}});
    return found == index_.end() ? nullptr : &pairs_[found->second];
  };
  if (const auto* heard = std::get_if<client::Pose>(&message)) {
    if (Pair* const pair = pair_with(heard->peer)) add_pose(*pair, neighbor_pose_of(*heard), now);
  } else if (const auto* status = std::get_if<client::Status>(&message)) {
    for (const client::Status::Neighbor& neighbor : status->neighbors) {
      if (Pair* const pair = pair_with(neighbor.peer)) pair->view.set_reason(neighbor.reason);
    }
  }
}

void DemoPairs::add_pose(Pair& pair, NeighborPose pose, Timestamp now) {
  pose.published = clocks_.at(pair.observer).local(to_seconds(now - start_));
  pair.view.update(pose, now);
  if (!pair.first_pose) pair.first_pose = now - start_;
  if (pair.poses.empty() || pose.stamp > pair.poses.back().stamp) pair.poses.push_back(pose);
  if (kept_) forget_old(pair.poses, *kept_);
}

std::vector<DemoRow> DemoPairs::live_rows(Timestamp now) const {
  std::vector<DemoRow> rows;
  rows.reserve(pairs_.size());
  for (const Pair& pair : pairs_) rows.push_back(live_row(pair, now));
  return rows;
}

DemoRow DemoPairs::live_row(const Pair& pair, Timestamp now) const {
  DemoRow row{
      .pair = fmt::format("{}->{}", name_of_robot(pair.observer), name_of_robot(pair.neighbor)),
      .known = {},
      .reason = pair.view.reason()};
  if (pair.first_pose) row.first_pose_s = to_seconds(*pair.first_pose);
  const NeighborPose* pose = pair.view.pose(now);
  if (pose == nullptr) return row;
  const Pose T_B_N = truth(pair, pose->stamp);
  const Vector6d d = pose_difference(pose->T_B_N.pose, T_B_N);
  const PoseSigma sigma = sigma_of(pose->T_B_N.covariance);
  row.known = {.mode = std::string(name_of(pose->mode)),
               .range_m = T_B_N.p.norm(),
               .error_m = d.head<3>().norm(),
               .error_deg = kDegPerRad * d.tail<3>().norm(),
               .sigma_m = sigma.position_m,
               .sigma_deg = kDegPerRad * sigma.rotation_rad,
               .age_ms = 1e3 * to_seconds(pose->published - pose->stamp)};
  return row;
}

std::vector<DemoSummary::Pair> DemoPairs::score(double from_world_s, double to_world_s) const {
  std::vector<DemoSummary::Pair> scores;
  scores.reserve(pairs_.size());
  for (const Pair& pair : pairs_) {
    const RobotClock& clock = clocks_.at(pair.observer);
    scores.push_back({.observer = pair.observer,
                      .neighbor = pair.neighbor,
                      .first_pose = pair.first_pose,
                      .score = score_pair(
                          pair.poses, [&](Timestamp t) { return truth(pair, t); }, clock.local(0.0),
                          {.begin = clock.local(from_world_s), .end = clock.local(to_world_s)})});
  }
  return scores;
}

Pose DemoPairs::truth(const Pair& pair, Timestamp stamp) const {
  return world_.T_B_N(pair.observer, pair.neighbor, clocks_.at(pair.observer).true_s(stamp));
}

}  // namespace crepes
