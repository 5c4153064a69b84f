/// What was measured over some seconds to a robot that nobody saw.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <deque>
#include <map>
#include <vector>

#include "estimator/core/imu_history.hpp"
#include "estimator/relative/neighbor_filter.hpp"
#include "estimator/team/unseen/carried_motion.hpp"
#include "estimator/team/unseen/range_track.hpp"

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
struct RangeProblemSettings {
  Eigen::Vector3d p_body_uwb = Eigen::Vector3d::Zero();  ///< antenna of the robot
  ImuBias self_bias;
  double self_gyro_variance = 0.0;   ///< of that bias, an axis [rad^2/s^2]
  double self_accel_variance = 0.0;  ///< likewise [m^2/s^4]
  ProcessNoise noise;
  Priors priors;
};

/// A range, and all of it that does not change from one fit to the next: the IMU's path begins at
/// rest at the origin.
struct FittedRange {
  RangeReading reading;
  Eigen::Vector3d p_F_beacon;  ///< in the frame of the first interval
  int error = 0;               ///< index of the beacon's
  double t_s = 0.0;
  Eigen::Vector3d p;
  Eigen::Quaterniond q;
  Eigen::Matrix<double, 3, CarriedMotion::kErrors> p_by_errors;
  Eigen::Matrix<double, 3, CarriedMotion::kErrors> theta_by_errors;
  Eigen::Matrix3d p_noise;

  FittedRange(const RangeReading& range, Eigen::Vector3d beacon, int index,
              const CarriedMotion& path);
};

/// All ranges of the intervals, with both robots' paths, in the frame of the first interval. A
/// robot's path is by its IMU alone.
struct RangeProblem {
  RangeProblem(const std::deque<UnseenInterval>& intervals, const RangeProblemSettings& settings);

  /// Where this path has the antenna.
  [[nodiscard]] Eigen::Vector3d antenna(const FreeMotion& motion) const {
    return motion.p_F + motion.q_F_B * p_body_uwb;
  }

  Eigen::Vector3d p_body_uwb;
  std::vector<FittedRange> ranges;
  std::vector<RangeSpheres> spheres;  ///< of intervals with enough
  RangeTrack by_imu;                  ///< the antenna's path at the same times
  CarriedMotion end;                  ///< of the robot
  CarriedMotion self_end;
  Eigen::VectorXd prior;  ///< information about [motion, IMU's errors, beacons' errors]

 private:
  void add(const UnseenInterval& interval, const std::map<RobotId, double>& beacons,
           const RangeProblemSettings& settings);
};

}  // namespace crepes
