#include "estimator/swarm/graph_problem_builder.hpp"

#include <algorithm>
#include <utility>

#include "estimator/relative/propagation.hpp"

namespace crepes {
namespace {

constexpr Duration kMaxEstimateAge = std::chrono::milliseconds{500};
// An estimate is not carried across a longer time without samples: the error that it gains there is
// not in its covariance.
constexpr Duration kMaxExtrapolation = std::chrono::milliseconds{200};
// Errors that IMU integration adds to a propagated estimate.
constexpr double kSpeedError = 0.1;  // m/s
constexpr double kTurnError = 0.02;  // rad/s

bool is_of_swarm(RobotId robot, const SwarmConfig& swarm) {
  return std::ranges::find(swarm.members, robot, &MemberConfig::id) != swarm.members.end();
}

// The estimate propagated to `stamp`. Its position covariance turns with the observer's axes.
RelativePoseEdge propagated_edge(RobotId from, const NeighborEstimate& estimate,
                                 const ImuHistory& imu_from, const ImuHistory& imu_to,
                                 Timestamp stamp) {
  const RelativeMotion motion = propagated_by_imus({estimate.T_B_N.pose, estimate.v_B_N}, imu_from,
                                                   imu_to, estimate.stamp, stamp);
  const Matrix6d turn = error_rotation(imu_from, imu_to, estimate.stamp, stamp);
  Matrix6d covariance = turn * estimate.T_B_N.covariance * turn.transpose();
  const double dt = to_seconds(stamp - estimate.stamp);
  covariance.diagonal().head<3>().array() += kSpeedError * kSpeedError * dt * dt;
  covariance.diagonal().tail<3>().array() += kTurnError * kTurnError * dt * dt;
  return {from, estimate.neighbor, {motion.T_B_N, covariance}, motion.v_B_N, estimate.stamp};
}

}  // namespace

void GraphProblemBuilder::add_report(const Report& report, const SwarmConfig& swarm) {
  for (const NeighborEstimate& estimate : report.estimates) {
    if (estimate.neighbor == report.sender || !is_of_swarm(estimate.neighbor, swarm)) continue;
    const auto key = std::pair(report.sender, estimate.neighbor);
    const auto known = estimates_.find(key);
    if (known == estimates_.end() || known->second.stamp < estimate.stamp) {
      estimates_.insert_or_assign(key, estimate);
    }
  }
}

GraphProblem GraphProblemBuilder::build(Timestamp stamp, RobotId self,
                                        const std::vector<NeighborEstimate>& own,
                                        const ImuOf& imu_of) const {
  GraphProblem problem{.stamp = stamp, .self = self, .edges = {}};
  for (const NeighborEstimate& estimate : own) {
    problem.edges.push_back(
        {self, estimate.neighbor, estimate.T_B_N, estimate.v_B_N, estimate.stamp});
  }
  for (const auto& [pair, estimate] : estimates_) {
    if (std::chrono::abs(stamp - estimate.stamp) > kMaxEstimateAge) continue;
    const ImuHistory* imu_from = imu_of(pair.first);
    const ImuHistory* imu_to = imu_of(pair.second);
    if (imu_from == nullptr || imu_to == nullptr ||
        imu_from->extrapolated(estimate.stamp, stamp) > kMaxExtrapolation ||
        imu_to->extrapolated(estimate.stamp, stamp) > kMaxExtrapolation)
      continue;
    problem.edges.push_back(propagated_edge(pair.first, estimate, *imu_from, *imu_to, stamp));
  }
  return problem;
}

}  // namespace crepes
