/// Where a robot is that nobody has seen, by its ranges and its IMU over some seconds.
#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>
#include <vector>

#include "estimator/core/imu_history.hpp"
#include "estimator/relative/neighbor_filter.hpp"
#include "estimator/team/robot_trajectory.hpp"
#include "estimator/team/team_place.hpp"

namespace crepes {

/// A range between the robot and one whose place is known, the beacon.
struct BeaconRange {
  RobotId beacon{};
  double t_s = 0.0;  ///< after the beginning of the interval
  RangeReading reading;
  Eigen::Vector3d p_F_beacon = Eigen::Vector3d::Zero();  ///< its antenna, then
  double beacon_variance_m2 = 0.0;                       ///< trace of its covariance
};

/// An interval in which nobody saw the robot. Its frame F falls freely with this robot (self) from
/// the beginning of the interval on.
struct UnseenInterval {
  double duration_s = 0.0;
  std::vector<ImuMean> imu;
  std::vector<ImuMean> self_imu;
  std::vector<BeaconRange> ranges;
};

/// What is known of the two robots beforehand.
struct RangePlaceSettings {
  Eigen::Vector3d p_body_uwb = Eigen::Vector3d::Zero();  ///< antenna of the robot
  ImuBias self_bias;
  double self_gyro_variance = 0.0;   ///< of that bias, an axis [rad^2/s^2]
  double self_accel_variance = 0.0;  ///< likewise [m^2/s^4]
  ProcessNoise noise;
  Priors priors;
};

/// The robot at the end of intervals that follow each other, by ranges to four or more beacons. A
/// range_track starts nonlinear least squares over all ranges with Huber's weights: unknown are the
/// motion, the IMU's errors, and a constant error a beacon. The mirror image and other headings are
/// tried as well. One that is near and nearly as likely enlarges the covariance so that it contains
/// it. Empty if one elsewhere is, if the place or the attitude is too uncertain, or if too many
/// ranges contradict it.
[[nodiscard]] std::optional<TeamPlace> place_by_ranges(const std::deque<UnseenInterval>& intervals,
                                                       const RangePlaceSettings& settings);

}  // namespace crepes
