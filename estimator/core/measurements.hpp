/// Measurements of sensors and peers, reports, and problems of the pose graph.
#pragma once

#include <Eigen/Core>
#include <compare>
#include <cstdint>
#include <vector>

#include "estimator/core/pose.hpp"
#include "estimator/core/time.hpp"

namespace crepes {

/// A robot of the swarm, 1..65534.
struct RobotId {
  std::uint16_t value = 0;
  // NOLINTNEXTLINE(modernize-use-nullptr): clang-tidy 14 takes the 0 behind <=> for a pointer
  auto operator<=>(const RobotId&) const = default;
};

/// Body rates and specific force (+9.81 up at rest), body axes. `Time` is the type of its clock.
template <class Time>
struct BasicImuSample {
  Time stamp{};
  Eigen::Vector3d gyro_radps = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_mps2 = Eigen::Vector3d::Zero();
};

/// A distance between the UWB antennas of the robot that measured it and `neighbor`.
template <class Time>
struct BasicUwbRange {
  Time stamp{};
  RobotId neighbor{};
  double range_m = 0.0;
  double first_path_dbm = 0.0;
  double received_dbm = 0.0;
};

/// The direction in which a robot's camera sees the LED ring of `neighbor`.
template <class Time>
struct BasicBearing {
  Time stamp{};
  RobotId neighbor{};
  Eigen::Vector3d u_B = Eigen::Vector3d::UnitX();   ///< unit direction, observer's body axes
  Eigen::Vector3d p_B_C = Eigen::Vector3d::Zero();  ///< the camera's optical center in the body [m]
  double sigma_rad = 0.0;                           ///< one sigma across the direction
};

/// The direction of up. Gravity determines roll and pitch only.
template <class Time>
struct BasicTilt {
  Time stamp{};
  Eigen::Vector3d up_B = Eigen::Vector3d::UnitZ();  ///< unit vector against gravity, body axes
  double sigma_rad = 0.0;                           ///< one sigma about either horizontal axis
};

/// One robot's own estimate of a neighbor, as it travels over the mesh.
template <class Time>
struct BasicNeighborEstimate {
  Time stamp{};
  RobotId neighbor{};
  GaussianPose T_B_N;
  Eigen::Vector3d v_B_N = Eigen::Vector3d::Zero();  ///< R_W_B^T (v_W_N - v_W_B) [m/s], body axes
};

/// The broadcast of a robot, in its own time.
template <class Time>
struct BasicReport {
  RobotId sender{};
  Time stamp{};
  BasicTilt<Time> tilt;
  std::vector<BasicImuSample<Time>> imu;
  std::vector<BasicBearing<Time>> bearings;
  std::vector<BasicUwbRange<Time>> ranges;
  std::vector<BasicNeighborEstimate<Time>> estimates;  ///< measured ones only: the graph's edges
};

using ImuSample = BasicImuSample<Timestamp>;
using UwbRange = BasicUwbRange<Timestamp>;
using Bearing = BasicBearing<Timestamp>;
using Tilt = BasicTilt<Timestamp>;
using NeighborEstimate = BasicNeighborEstimate<Timestamp>;
/// This robot's report as it leaves, or a peer's after its stamps were brought to our timeline.
using Report = BasicReport<Timestamp>;
/// A peer's report as it came, in the peer's time.
using PeerReport = BasicReport<PeerTimestamp>;

/// A bright spot of one camera image; pixel centers have integer coordinates.
struct Spot {
  double u_px = 0.0;
  double v_px = 0.0;
  double area_px2 = 0.0;
  double peak = 0.0;        ///< grey level 0..255
  double elongation = 1.0;  ///< ratio of principal axes, 1 for round
};

/// All spots of one image; an empty frame is information too.
struct SpotFrame {
  Timestamp stamp{};
  std::uint8_t camera = 0;  ///< index into the configured cameras
  std::vector<Spot> spots;
};

/// A peer's report on our timeline.
struct ReceivedReport {
  Report report;
  double clock_sigma_s = 0.0;  ///< one sigma of the clock offset that was used
};

/// A measured relative pose, the edge of the pose graph.
struct RelativePoseEdge {
  RobotId from{};
  RobotId to{};
  GaussianPose T_from_to;
  Eigen::Vector3d v_from_to = Eigen::Vector3d::Zero();  ///< R_W_from^T (v_W_to - v_W_from)
};

/// Input of the graph: all edges at one instant.
struct GraphProblem {
  Timestamp stamp{};
  RobotId self{};
  std::vector<RelativePoseEdge> edges;
};

/// One robot as the graph sees it from here.
struct GraphPose {
  RobotId neighbor{};
  GaussianPose T_B_N;
  Eigen::Vector3d v_B_N = Eigen::Vector3d::Zero();
};

/// The graph's answer, in this robot's body frame at `stamp`.
struct GraphSolution {
  Timestamp stamp{};
  std::vector<GraphPose> poses;  ///< ordered by neighbor; unreachable robots are absent
  double cost = 0.0;
  int iterations = 0;
};

/// One robot as the team's filter knows it, in this robot's body frame.
struct TeamPose {
  RobotId neighbor{};
  Pose T_B_N;
  Eigen::Vector3d v_B_N = Eigen::Vector3d::Zero();  ///< R_W_B^T (v_W_N - v_W_B) [m/s]
  /// Of [p, v, theta], theta a right perturbation.
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();
  /// When anybody saw it, or it anybody, or ranges of robots that are seen located it.
  Timestamp last_sighting{};
  Duration clock_ahead{};     ///< its sensors' stamps are so much ahead of this robot's
};

/// What the team's filter knows of a robot's IMU.
struct ImuBiasEstimate {
  RobotId robot{};
  Eigen::Vector3d gyro_radps = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_mps2 = Eigen::Vector3d::Zero();
  Eigen::Matrix3d gyro_scale = Eigen::Matrix3d::Zero();  ///< the rate reads (I + scale) w + bias
  double gyro_sigma_radps = 0.0;                         ///< root mean square of the axes
  double accel_sigma_mps2 = 0.0;
};

/// A robot whose sensors contradict the rest of the team.
struct TeamFault {
  enum class Kind : std::uint8_t {
    kCameraTurned,   ///< its bearings are used with the misalignment that the team found
    kCameraRefused,  ///< it contradicts the team whatever its misalignment
    kRanges,         ///< its ranges are refused
    kClock,          ///< its stamps are used with the offset that the team found
    kGyro,           ///< it reads other rates than its cameras show; the robot is left out
  };
  RobotId robot{};
  Kind kind = Kind::kCameraTurned;
  /// [rad] of a camera, [m] of ranges, positive if they are too long, [s] of a clock, positive if
  /// it is ahead, [rad/s] of a gyroscope.
  double size = 0.0;

  [[nodiscard]] bool operator==(const TeamFault&) const = default;
};

/// The team's answer, in this robot's body frame at `stamp`.
struct TeamSolution {
  Timestamp stamp{};
  std::vector<TeamPose> poses;          ///< ordered by neighbor
  std::vector<ImuBiasEstimate> biases;  ///< of this robot and of all in `poses`
  std::vector<TeamFault> faults;
};

}  // namespace crepes
