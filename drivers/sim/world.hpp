/// A world that is a function of seed and time, so that separate processes agree on it.
#pragma once

#include <Eigen/Core>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "drivers/sim/motion.hpp"
#include "drivers/sim/motion_track.hpp"
#include "drivers/sim/sim_config.hpp"
#include "estimator/core/measurements.hpp"

namespace crepes {

/// A vertical cylinder of infinite height that occludes robots from each other.
struct Pillar {
  Eigen::Vector2d center_W = Eigen::Vector2d::Zero();
  double radius_m = 0.0;
};

/// Of the triangle in which the robots of `kFormation` begin, more or less [m].
inline constexpr double kFormationSide = 4.0;

/// The robots of a scenario, ids 1..n, in a z-up world W. Immutable: threads may share it.
class SimWorld {
 public:
  /// Uses `scenario`, `seed` and `track` only.
  explicit SimWorld(const SimConfig& config);
  /// Other robots than those of a scenario, for studies.
  SimWorld(int seed, std::map<RobotId, Motion> motions)
      : seed_(seed), motions_(std::move(motions)) {}

  [[nodiscard]] std::vector<RobotId> robots() const;
  [[nodiscard]] bool contains(RobotId robot) const { return motions_.contains(robot); }
  [[nodiscard]] int seed() const { return seed_; }
  /// Why the track cannot be read; empty if it can, or there is none.
  [[nodiscard]] const std::string& fault() const { return fault_; }

  /// Truth at world time `t_s`; the robot must exist.
  [[nodiscard]] BodyState state(RobotId robot, double t_s) const;
  [[nodiscard]] Pose T_W_B(RobotId robot, double t_s) const { return state(robot, t_s).T_W_B; }
  /// Whether it is a multirotor: its IMU vibrates.
  [[nodiscard]] bool has_rotors(RobotId robot) const;
  /// The pose of `neighbor` as seen by `observer`.
  [[nodiscard]] Pose T_B_N(RobotId observer, RobotId neighbor, double t_s) const;

  /// Whether the line between two points is occluded.
  [[nodiscard]] bool is_occluded(const Eigen::Vector3d& p_W_from,
                                 const Eigen::Vector3d& p_W_to) const;

 private:
  int seed_;
  std::map<RobotId, Motion> motions_;
  std::vector<Pillar> pillars_;
  std::shared_ptr<const MotionTrackReader> track_;  ///< copies of a world read the same
  std::string fault_;
};

}  // namespace crepes
