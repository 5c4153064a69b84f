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

/// How the light of a bearing got its ID.
enum class Naming : std::uint8_t {
  kRead,       ///< from its blinking, up to this frame
  kPredicted,  ///< it is where and when the board is expected; its blinking is still to be read
};

/// The direction in which a robot's camera sees the LED ring of `neighbor`.
template <class Time>
struct BasicBearing {
  Time stamp{};
  RobotId neighbor{};
  Eigen::Vector3d u_B = Eigen::Vector3d::UnitX();   ///< unit direction, observer's body axes
  Eigen::Vector3d p_B_C = Eigen::Vector3d::Zero();  ///< the camera's optical center in the body [m]
  double sigma_rad = 0.0;                           ///< one sigma across the direction
  Naming how = Naming::kRead;                       ///< those of a report are read
  double peak = 0.0;                                ///< gray levels; reports do not say
  /// From the camera to the center of the ring, by the ring's size in the picture [m]; 0: it was
  /// not measured. Reports do not say.
  double distance_m = 0.0;
  double distance_sigma_m = 0.0;  ///< one sigma of what is another error in each frame
};

/// The lever arms that readings of a pair refer to: rings of LEDs and antennas, in each one's body.
struct PairMounting {
  Eigen::Vector3d p_B_M = Eigen::Vector3d::Zero();  ///< our LED ring
  Eigen::Vector3d p_B_U = Eigen::Vector3d::Zero();  ///< our antenna
  Eigen::Vector3d p_N_M = Eigen::Vector3d::Zero();  ///< the neighbor's LED ring
  Eigen::Vector3d p_N_Q = Eigen::Vector3d::Zero();  ///< the neighbor's antenna
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
  /// One sigma of its velocity [m/s], of which it says nothing else: nobody sends one that is known
  /// worse, and who starts from it assumes as much.
  static constexpr double kSpeedSigma = 0.3;

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

/// The ellipse as which the ring of a near board appears, about the center of its spot: the
/// points A q with |q| = 1, of which this is A A^T. All zeros: its LEDs were not told apart.
struct RingEllipse {
  int leds = 0;
  double uu_px2 = 0.0;
  double uv_px2 = 0.0;
  double vv_px2 = 0.0;
  double sigma = 0.0;  ///< of its size, relative, by how well the LEDs fit it

  [[nodiscard]] bool is_known() const { return leds > 0; }
};

/// A bright spot of one camera image; pixel centers have integer coordinates.
struct Spot {
  double u_px = 0.0;
  double v_px = 0.0;
  double area_px2 = 0.0;
  double peak = 0.0;        ///< grey level 0..255
  double elongation = 1.0;  ///< ratio of principal axes, 1 for round
  RingEllipse ring{};
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
  Timestamp estimated{};  ///< when; the pair had seen each other just before
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
};

}  // namespace crepes
