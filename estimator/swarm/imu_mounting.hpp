/// Finds robots whose IMU is not mounted as their configuration says.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>

#include "estimator/core/imu_history.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/team_solution.hpp"

namespace crepes {

/// What the samples and bearings of one robot say of R, the rotation from the axes of its samples
/// to those of the body that its cameras show.
///
/// While the robot turns by theta, the direction u of a neighbor changes by u x R theta, and by how
/// the two move. If they see each other at once, their elevations above the horizon are opposite.
/// Both are linear in the elements of R. So the sum of squares is a quadratic form in them, and no
/// reading needs to be kept.
///
/// In a formation that turns about a point, neighbors stay where they are in the body, and the bank
/// of the turn tilts the horizon: as if the IMU lay on its side. So a rotation must explain the
/// turns better than neighbors that turn with the robot do, too.
class MountingEvidence {
 public:
  /// Unit directions of a neighbor before and after a turn by theta [rad], as the IMU reads it.
  void add_turn(const Eigen::Vector3d& before, const Eigen::Vector3d& after,
                const Eigen::Vector3d& theta);
  /// Unit directions of a neighbor and, as the IMU reads it, of up; and the sine of the elevation
  /// at which that neighbor sees this robot.
  void add_elevation(const Eigen::Vector3d& u, const Eigen::Vector3d& up, double sine);
  /// Scales all that is known.
  void fade(double kept);

  /// The rotation, if one of many degrees explains the turns much better than none does, and the
  /// elevations no worse than accelerations allow.
  [[nodiscard]] std::optional<Eigen::Matrix3d> rotation() const;
  /// Whether the turns show clearly that there is none instead of this one.
  [[nodiscard]] bool excludes(const Eigen::Matrix3d& R) const;

 private:
  using Elements = Eigen::Matrix<double, 9, 1>;  ///< the columns of R
  using Row = Eigen::Matrix<double, 1, 9>;
  using Information = Eigen::Matrix<double, 9, 9>;

  /// Sum of (row R - value)^2.
  struct Squares {
    Information M = Information::Zero();
    Elements b = Elements::Zero();
    double c = 0.0;
    double count = 0.0;  ///< of what was observed; a turn has three components

    void add(const Row& row, double value);
    void fade(double kept);
    [[nodiscard]] double at(const Eigen::Matrix3d& R) const;
    [[nodiscard]] double root_mean(const Eigen::Matrix3d& R) const;
  };

  [[nodiscard]] Eigen::Matrix3d likeliest() const;

  Squares turns_;
  Squares elevations_;
};

/// Of all robots of the swarm.
class ImuMounting {
 public:
  /// A bearing of any robot, and that robot's samples. Bearings that are repeated are ignored.
  void add(RobotId observer, const Bearing& bearing, const ImuHistory& imu);
  /// Whether its poses, and those of others from it, are wrong for that.
  [[nodiscard]] bool is_wrong(RobotId robot) const;
  /// Empty if it is mounted as configured, as far as is known.
  [[nodiscard]] std::optional<TeamFault> fault_of(RobotId robot) const;

 private:
  struct Elevation {
    Timestamp stamp = kNever;
    double sine = 0.0;
  };
  struct Robot {
    MountingEvidence evidence;  ///< of up to half a minute, or longer if it hardly turned
    MountingEvidence recent;    ///< of the last seconds
    std::optional<Eigen::Matrix3d> rotation;  ///< it is mounted so
    Timestamp newest = kNever;
    Timestamp judged = kNever;
    std::map<RobotId, Bearing> bearings;      ///< the beginnings of turns, by neighbor
    std::map<RobotId, Elevation> elevations;  ///< at which it saw the neighbor last
  };
  static void judge(Robot& robot);

  std::map<RobotId, Robot> robots_;  ///< of members alone
};

}  // namespace crepes
