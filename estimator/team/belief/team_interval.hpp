/// What the team's filter receives: everything that anybody measured within one interval.
#pragma once

#include <algorithm>
#include <vector>

#include "estimator/core/imu_history.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/relative/neighbor_filter.hpp"
#include "estimator/relative/propagation.hpp"

namespace crepes {

/// The motion of one robot over the interval, and its lever arms.
struct TeamMember {
  RobotId robot{};
  Eigen::Vector3d p_body_led = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_body_uwb = Eigen::Vector3d::Zero();
  std::vector<ImuMean> imu;  ///< of each step of the interval
};

/// A bearing and the robot that measured it.
struct TeamBearing {
  RobotId observer{};
  Bearing bearing;
};

/// A range and the robot that measured it.
struct TeamRange {
  RobotId observer{};
  RobotId neighbor{};
  Timestamp stamp{};
  RangeReading reading;
};

/// The settings of the team's filter.
struct TeamSettings {
  ProcessNoise noise;
  Priors priors;
  double bearing_gate = 0.0;  ///< on the NIS
  double range_gate = 0.0;
  std::size_t max_robots = 12;
};

/// Intervals follow each other without a gap. Every measurement is in one of them, once.
struct TeamInterval {
  static constexpr Duration kStep = std::chrono::milliseconds{10};

  RobotId self{};
  Timestamp from{};
  Timestamp to{};
  std::vector<TeamMember> members;  ///< self and those whose IMU covers the interval
  std::vector<TeamBearing> bearings;
  std::vector<TeamRange> ranges;
  /// Estimates at `to`. A robot that the filter does not know yet starts from them.
  std::vector<RelativePoseEdge> edges;
  TeamSettings settings;

  /// Null if its IMU does not cover the interval.
  [[nodiscard]] const TeamMember* member(RobotId robot) const {
    const auto found = std::ranges::find(members, robot, &TeamMember::robot);
    return found == members.end() ? nullptr : &*found;
  }
  /// Whether what was stamped then belongs to this interval, and to no other one.
  [[nodiscard]] bool contains(Timestamp stamp) const { return stamp > from && stamp <= to; }
};

}  // namespace crepes
