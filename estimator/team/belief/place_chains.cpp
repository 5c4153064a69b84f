#include "estimator/team/belief/place_chains.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

namespace crepes {
namespace {

/// One end of the edge by the other, `via`.
TeamPlace beyond(const TeamPlace& via, const RelativePoseEdge& edge, bool is_forward,
                 RobotId self) {
  GaussianPose step = is_forward ? edge.T_from_to : inverse(edge.T_from_to);
  if (edge.from != self) step.covariance += start_floor();
  const Eigen::Vector3d v =
      is_forward ? edge.v_from_to
                 : Eigen::Vector3d(-(edge.T_from_to.pose.R().transpose() * edge.v_from_to));
  return via.beyond(is_forward ? edge.from : edge.to, step, v, edge.estimated);
}

}  // namespace

Matrix6d start_floor() {
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(kStartPosition * kStartPosition),
      Eigen::Vector3d::Constant(kStartAttitude * kStartAttitude);
  return variance.asDiagonal();
}

bool can_place(const RelativePoseEdge& edge, const std::set<RobotId>& liars) {
  const Matrix6d& covariance = edge.T_from_to.covariance;
  return !liars.contains(edge.from) && edge.T_from_to.pose.p.allFinite() &&
         edge.T_from_to.pose.q.coeffs().allFinite() && edge.v_from_to.allFinite() &&
         covariance.allFinite() && Eigen::LLT<Matrix6d>(covariance).info() == Eigen::Success;
}

std::vector<std::pair<RobotId, TeamPlace>> places_by_chains(std::map<RobotId, TeamPlace> known,
                                                            std::map<RobotId, TeamPlace> candidates,
                                                            const std::set<RobotId>& liars,
                                                            const TeamInterval& interval) {
  const auto add_candidates_from = [&](RobotId id) {
    const TeamPlace& via = known.at(id);
    for (const RelativePoseEdge& edge : interval.edges) {
      const bool is_forward = edge.from == id;
      const RobotId other = is_forward ? edge.to : edge.from;
      if ((!is_forward && edge.to != id) || known.contains(other) ||
          interval.member(other) == nullptr || !can_place(edge, liars))
        continue;
      const TeamPlace place = beyond(via, edge, is_forward, interval.self);
      const auto [best, is_first] = candidates.try_emplace(other, place);
      if (!is_first && place.doubt() < best->second.doubt()) best->second = place;
    }
  };
  const std::map<RobotId, TeamPlace> before = known;
  for (const auto& [id, place] : before) add_candidates_from(id);
  std::vector<std::pair<RobotId, TeamPlace>> found;
  while (!candidates.empty()) {
    const auto best = std::ranges::min_element(
        candidates, {}, [](const auto& candidate) { return candidate.second.doubt(); });
    const auto [id, place] = found.emplace_back(*best);
    candidates.erase(best);
    known.emplace(id, place);
    add_candidates_from(id);
  }
  return found;
}

}  // namespace crepes
