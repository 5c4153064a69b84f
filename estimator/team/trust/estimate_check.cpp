#include "estimator/team/trust/estimate_check.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

constexpr double kMemory = 0.5;      // s
constexpr double kLeastError = 0.3;  // m; nothing smaller is called wrong
constexpr double kFarAway = 100.0;   // chi-square; ten sigmas
constexpr double kFloor = 0.05;      // m; what an estimate is believed at best

/// How far an estimate is off, and whether that is beyond all doubt.
struct EstimateError {
  double size_m = 0.0;
  bool is_gross = false;
};

EstimateError error_of(const RelativePoseEdge& edge, const TeamBelief& belief) {
  const TeamRobot& from = belief.robots.at(edge.from);
  const TeamRobot& to = belief.robots.at(edge.to);
  const Eigen::Matrix3d R = from.motion.R();
  const Eigen::Vector3d p = R.transpose() * (to.motion.p_F - from.motion.p_F);
  const Eigen::Vector3d error = edge.T_from_to.pose.p - p;
  Eigen::Matrix3d S = edge.T_from_to.covariance.topLeftCorner<3, 3>();
  S += R.transpose() * belief.position_covariance(edge.from, edge.to) * R;
  S.diagonal().array() += kFloor * kFloor;
  if (from.motion_index >= 0) {
    const int theta = from.motion_index + 6;
    S += hat(p) * belief.P.block<3, 3>(theta, theta) * hat(p).transpose();
  }
  const Eigen::LLT<Eigen::Matrix3d> factors(S);
  return {.size_m = error.norm(),
          .is_gross = factors.info() == Eigen::Success && error.norm() > kLeastError &&
                      error.dot(factors.solve(error)) > kFarAway};
}

}  // namespace

void EstimateCheck::add(const TeamInterval& interval, const TeamBelief& belief) {
  const auto is_trusted = [&](RobotId id) {
    const auto robot = belief.robots.find(id);
    return robot != belief.robots.end() && robot->second.is_trusted;
  };
  std::erase_if(doubts_, [&](const auto& entry) {
    return !is_trusted(entry.first.first) || !is_trusted(entry.first.second);
  });
  const double kept = std::exp(-to_seconds(interval.to - interval.from) / kMemory);
  for (auto& [pair, doubt] : doubts_) doubt.agreement.fade(kept);
  for (const RelativePoseEdge& edge : interval.edges) {
    if (!is_trusted(edge.from) || !is_trusted(edge.to)) continue;
    const EstimateError error = error_of(edge, belief);
    Doubt& doubt = doubts_[{edge.from, edge.to}];
    doubt.agreement.add(!error.is_gross);
    if (error.is_gross) doubt.error_m = error.size_m;
  }
}

std::vector<TeamFault> EstimateCheck::faults() const {
  struct Sum {
    int estimated = 0;
    int wrong = 0;
    double error_m = 0.0;
  };
  std::map<RobotId, Sum> sums;
  for (const auto& [pair, doubt] : doubts_) {
    Sum& sum = sums[pair.first];
    sum.estimated += doubt.agreement.fused + doubt.agreement.gated > 1.0 ? 1 : 0;
    if (!doubt.agreement.is_contradiction()) continue;
    ++sum.wrong;
    sum.error_m += doubt.error_m;
  }
  std::vector<TeamFault> faults;
  for (const auto& [robot, sum] : sums) {
    if (sum.wrong >= 2 && 2 * sum.wrong > sum.estimated)
      faults.push_back({robot, TeamFault::Kind::kEstimates, sum.error_m / sum.wrong});
  }
  return faults;
}

}  // namespace crepes
