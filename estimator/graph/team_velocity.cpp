#include "estimator/graph/team_velocity.hpp"

#include <Eigen/Cholesky>

namespace crepes {

std::map<RobotId, Eigen::Vector3d> team_velocities(RobotId self,
                                                   const std::map<RobotId, Pose>& T_self,
                                                   const std::vector<RelativePoseEdge>& edges) {
  std::map<RobotId, Eigen::Index> column;
  for (const auto& [robot, pose] : T_self) {
    if (robot != self) column.emplace(robot, static_cast<Eigen::Index>(column.size()));
  }
  const auto count = static_cast<Eigen::Index>(column.size());

  // Normal equations; the three axes share one matrix. Self stands at zero and has no column.
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(count, count);
  Eigen::MatrixXd b = Eigen::MatrixXd::Zero(count, 3);
  for (const RelativePoseEdge& edge : edges) {
    if (!T_self.contains(edge.from) || !T_self.contains(edge.to)) continue;
    const Eigen::RowVector3d step = (T_self.at(edge.from).q * edge.v_from_to).transpose();
    const auto from = column.find(edge.from);
    const auto to = column.find(edge.to);
    if (to != column.end()) {
      A(to->second, to->second) += 1.0;
      b.row(to->second) += step;
    }
    if (from != column.end()) {
      A(from->second, from->second) += 1.0;
      b.row(from->second) -= step;
    }
    if (from != column.end() && to != column.end()) {
      A(from->second, to->second) -= 1.0;
      A(to->second, from->second) -= 1.0;
    }
  }
  const Eigen::MatrixXd v = A.ldlt().solve(b);

  std::map<RobotId, Eigen::Vector3d> velocities{{self, Eigen::Vector3d::Zero()}};
  for (const auto& [robot, index] : column) velocities.emplace(robot, v.row(index).transpose());
  return velocities;
}

}  // namespace crepes
