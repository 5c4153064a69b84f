/// Ground truth of a recorded swarm. Only evaluation uses it; no estimator receives it.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <vector>

#include "daemon/ctl/dataset/swarm_manifest.hpp"
#include "drivers/dataset/robot_clock.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/pose.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// The pose of a body in the world at an instant of true time.
struct TruthSample {
  double t_s = 0.0;
  Pose T_W_B;
};

/// The path of one robot through the world.
class Trajectory {
 public:
  /// Times must increase strictly.
  explicit Trajectory(std::vector<TruthSample> samples) : samples_(std::move(samples)) {}

  /// Reads `t [s], p_W (3), q_WB w x y z, v_W (3)`. Any bad row is an error: truth is exact.
  [[nodiscard]] static Result<Trajectory> load(const std::filesystem::path& file);

  /// Linear in position, spherically linear in attitude; empty outside the recorded times.
  [[nodiscard]] std::optional<Pose> at(double true_s) const;

 private:
  std::vector<TruthSample> samples_;
};

/// The trajectories of all robots.
class SwarmTruth {
 public:
  /// The true motion of one robot.
  struct Robot {
    RobotClock clock;
    Trajectory path;
  };
  explicit SwarmTruth(std::map<RobotId, Robot> robots) : robots_(std::move(robots)) {}

  /// Reads DIR/truth/<name>.csv of every robot.
  [[nodiscard]] static Result<SwarmTruth> load(const std::filesystem::path& dir,
                                               const SwarmManifest& manifest);

  /// T_W_B at an instant of true time; empty outside the recorded times and for a robot
  /// without truth.
  [[nodiscard]] std::optional<Pose> pose(RobotId robot, double true_s) const;
  /// T_B_N at an instant of the observer's own clock; empty outside the recorded times and
  /// for robots without truth.
  [[nodiscard]] std::optional<Pose> relative(RobotId observer, RobotId neighbor,
                                             Timestamp local) const;

 private:
  std::map<RobotId, Robot> robots_;
};

/// The angle between a bearing and the true direction of the neighbor's LED ring [rad]. A large
/// angle means a wrong ID.
[[nodiscard]] double bearing_error_rad(const Bearing& bearing, const Pose& T_B_N,
                                       const Eigen::Vector3d& p_body_led);

}  // namespace crepes
