#include "estimator/graph/spanning_tree.hpp"

#include <algorithm>

namespace crepes {
namespace {

double variance_of(const GaussianPose& pose) {
  return pose.covariance.topLeftCorner<3, 3>().trace();
}

}  // namespace

std::map<RobotId, GaussianPose> spanning_tree_poses(RobotId self,
                                                    const std::vector<RelativePoseEdge>& edges) {
  std::map<RobotId, GaussianPose> open{{self, {}}};
  std::map<RobotId, GaussianPose> settled;
  while (!open.empty()) {
    const auto nearest = std::min_element(open.begin(), open.end(), [](auto& a, auto& b) {
      return variance_of(a.second) < variance_of(b.second);
    });
    const auto [robot, T_self_robot] = *nearest;
    open.erase(nearest);
    settled.emplace(robot, T_self_robot);

    for (const RelativePoseEdge& edge : edges) {
      if (edge.from != robot && edge.to != robot) continue;
      const bool forward = edge.from == robot;
      const RobotId other = forward ? edge.to : edge.from;
      if (settled.contains(other)) continue;
      const GaussianPose T_self_other =
          T_self_robot * (forward ? edge.T_from_to : inverse(edge.T_from_to));
      const auto known = open.find(other);
      if (known != open.end() && variance_of(known->second) <= variance_of(T_self_other)) continue;
      open.insert_or_assign(other, T_self_other);
    }
  }
  return settled;
}

}  // namespace crepes
