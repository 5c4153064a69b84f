#include "estimator/graph/spanning_tree.hpp"

namespace crepes {
namespace {

struct Reached {
  Pose T_self_robot;
  double variance = 0.0;
};

}  // namespace

std::map<RobotId, Pose> spanning_tree_poses(RobotId self,
                                            const std::vector<RelativePoseEdge>& edges) {
  std::map<RobotId, Reached> open{{self, {}}};
  std::map<RobotId, Pose> settled;
  while (!open.empty()) {
    auto nearest = open.begin();
    for (auto it = open.begin(); it != open.end(); ++it) {
      if (it->second.variance < nearest->second.variance) nearest = it;
    }
    const auto [robot, reached] = *nearest;
    open.erase(nearest);
    settled.emplace(robot, reached.T_self_robot);

    for (const RelativePoseEdge& edge : edges) {
      if (edge.from != robot && edge.to != robot) continue;
      const bool forward = edge.from == robot;
      const RobotId other = forward ? edge.to : edge.from;
      if (settled.contains(other)) continue;
      const double variance =
          reached.variance + edge.T_from_to.covariance.topLeftCorner<3, 3>().trace();
      const auto known = open.find(other);
      if (known != open.end() && known->second.variance <= variance) continue;
      const Pose T_robot_other = forward ? edge.T_from_to.pose : edge.T_from_to.pose.inverse();
      open.insert_or_assign(other, Reached{reached.T_self_robot * T_robot_other, variance});
    }
  }
  return settled;
}

}  // namespace crepes
