/// One-shot relative pose from mutual bearings, range and gravity (paper III-C).
#pragma once

#include <Eigen/Core>
#include <variant>
#include <vector>

#include "estimator/core/outputs.hpp"
#include "estimator/core/pose.hpp"

namespace crepes {

/// Where camera, LED ring and antenna sit on a robot, in its body axes [m].
struct Mounting {
  Eigen::Vector3d camera = Eigen::Vector3d::Zero();
  Eigen::Vector3d led = Eigen::Vector3d::Zero();
  Eigen::Vector3d antenna = Eigen::Vector3d::Zero();
};

/// The measurements of one of the two robots.
struct Sighting {
  Eigen::Vector3d u = Eigen::Vector3d::UnitX();   ///< where its camera sees the other's ring
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< against gravity
  Mounting mounting;
  double bearing_sigma_rad = 0.0;
  double tilt_sigma_rad = 0.0;
};

/// Two robots that see each other at one instant: B, the observer, and N, its neighbor.
struct MutualSighting {
  Sighting B;
  Sighting N;
  double range_m = 0.0;  ///< antenna to antenna
  double range_sigma_m = 0.0;
};

/// Jacobians by the calibration errors that all raw poses share: both cameras' misalignment, both
/// accelerometers' bias and scale (which tilt "up"), and the pair's range bias.
struct CalibrationJacobian {
  Eigen::Matrix<double, 6, 3> by_misalignment_B = Eigen::Matrix<double, 6, 3>::Zero();
  Eigen::Matrix<double, 6, 3> by_misalignment_N = Eigen::Matrix<double, 6, 3>::Zero();
  Eigen::Matrix<double, 6, 3> by_accel_bias_B = Eigen::Matrix<double, 6, 3>::Zero();
  Eigen::Matrix<double, 6, 3> by_accel_bias_N = Eigen::Matrix<double, 6, 3>::Zero();
  Eigen::Matrix<double, 6, 9> by_accel_scale_B = Eigen::Matrix<double, 6, 9>::Zero();
  Eigen::Matrix<double, 6, 9> by_accel_scale_N = Eigen::Matrix<double, 6, 9>::Zero();
  Vector6d by_range_bias = Vector6d::Zero();
};

/// The measurement z of the paper's filter (eq. 16): p of N in B, p of B in N, R of N in B.
struct RawPose {
  Pose T_B_N;
  Eigen::Vector3d p_N_B = Eigen::Vector3d::Zero();
  /// Of [p_B_N, p_N_B, theta], theta a right perturbation of T_B_N's rotation.
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();
  /// Of gaussian()'s error. The covariance includes misalignments and range bias.
  CalibrationJacobian by_calibration;

  [[nodiscard]] GaussianPose gaussian() const;
};

/// A RawPose, or the reason why there is none: kNearVertical, kTooClose, kNoRange (the range
/// is shorter than the mountings allow), kUncertain (the two elevations contradict each other by
/// more than 5 sigma: not one line of sight).
///
/// With all mountings zero this is the paper's formula:  p = d u;  psi = psi_B - psi_N + pi;
/// R = (R_pitch R_roll)_B^T R_yaw(psi) (R_pitch R_roll)_N. Lever arms enter by iterating it.
[[nodiscard]] std::variant<RawPose, NoPoseReason> compute_raw_pose(const MutualSighting& sighting);

/// Poses of `seen` in `seer` from one robot's bearing, the range and both tilts. The heading is
/// unknown, so `count` Gaussians cover all headings. Empty if the range is shorter than the
/// mountings allow. `seen.u` is not used.
[[nodiscard]] std::vector<GaussianPose> poses_by_heading(const Sighting& seer, const Sighting& seen,
                                                         double range_m, double range_sigma_m,
                                                         int count);

}  // namespace crepes
