/// What the team's robots say of each other, brought to one instant for the pose graph.
#pragma once

#include <functional>
#include <map>
#include <utility>

#include "estimator/core/measurements.hpp"
#include "estimator/relative/imu_history.hpp"

namespace crepes {

/// Keeps the newest estimate of every ordered pair that peers broadcast.
class Team {
 public:
  /// The IMU of a robot, own or as it reports it; null where there is none.
  using ImuOf = std::function<const ImuHistory*(RobotId)>;

  void add(const Report& report);

  /// Own estimates, which are at `stamp` already, and those of others no older than half a second,
  /// carried to `stamp` by the IMUs of both robots.
  [[nodiscard]] GraphProblem problem(Timestamp stamp, RobotId self,
                                     const std::vector<NeighborEstimate>& own,
                                     const ImuOf& imu_of) const;

 private:
  std::map<std::pair<RobotId, RobotId>, NeighborEstimate> estimates_;
};

}  // namespace crepes
