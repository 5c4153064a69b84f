/// The track of a robot's antenna by ranges alone, and the attitude that an IMU's path has on it.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "estimator/team/belief/robot_trajectory.hpp"

namespace crepes {

/// Where the antenna was in one interval.
struct TrackPoint {
  double t_s = 0.0;  ///< after the beginning of the first interval
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
};
using RangeTrack = std::vector<TrackPoint>;

/// Ranges of one interval, as spheres about those that measured them.
struct RangeSpheres {
  double t_s = 0.0;                                         ///< in the mean
  std::vector<std::pair<Eigen::Vector3d, double>> spheres;  ///< center and radius, four or more
};

/// Four ranges or more determine each point (nonlinear least squares); if their centers are nearly
/// in a plane, so does its mirror image. The track begins on one side of that plane, `side` 1 or
/// -1.
[[nodiscard]] RangeTrack range_track(const std::vector<RangeSpheres>& all, double side);

/// The mirror image of a track in those planes.
[[nodiscard]] RangeTrack mirrored(RangeTrack track, const std::vector<RangeSpheres>& all);

/// The attitude in which a path bends like a track of the same times: of what a linear regression
/// leaves of both, the rotation between them (Kabsch 1976). The path begins at rest at the origin
/// with the attitude identity, as an IMU has it. Gravity bends both most.
[[nodiscard]] Eigen::Quaterniond attitude_along(const RangeTrack& track, const RangeTrack& path);

/// The motion at the beginning of the first interval that carries the path onto the track, with
/// this attitude.
[[nodiscard]] FreeMotion motion_along(const RangeTrack& track, const RangeTrack& path,
                                      const Eigen::Quaterniond& attitude);

}  // namespace crepes
