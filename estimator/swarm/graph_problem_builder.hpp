/// Builds the pose graph's problem from the estimates of all robots.
#pragma once

#include <functional>
#include <map>
#include <utility>

#include "estimator/core/imu_history.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/swarm_config.hpp"

namespace crepes {

/// Keeps the newest estimate of every ordered pair of robots that peers broadcast.
class GraphProblemBuilder {
 public:
  /// The IMU of a robot, own or as it reports it; null where there is none.
  using ImuOf = std::function<const ImuHistory*(RobotId)>;

  /// Keeps the estimates of a report for the next problem; those of robots that are no members are
  /// ignored.
  void add_report(const Report& report, const SwarmConfig& swarm);

  /// Edges at `stamp`: own estimates, which are at `stamp` already, then those of others not older
  /// than half a second, propagated by the IMUs of both robots.
  [[nodiscard]] GraphProblem build(Timestamp stamp, RobotId self,
                                   const std::vector<NeighborEstimate>& own,
                                   const ImuOf& imu_of) const;

 private:
  std::map<std::pair<RobotId, RobotId>, NeighborEstimate> estimates_;
};

}  // namespace crepes
